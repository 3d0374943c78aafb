"""Printed reports of results, units and certificates: their content from the stores, and their typesetting apart."""
