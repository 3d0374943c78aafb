"""Pure numbers and value types: numpy and scipy only. The floor of everything; knows no device, no file, no clock."""
