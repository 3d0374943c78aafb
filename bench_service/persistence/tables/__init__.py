"""The tables, by the same rooms as the ports of memory; `every` imports all of them, for migrations."""
