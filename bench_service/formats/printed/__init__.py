"""Printed reports as PDF/A-3: a document as plain data, laid out by typst, with files attached."""
