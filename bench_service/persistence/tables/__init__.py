"""SQL tables, one module for the stores of each package; `every` imports all of them, for migrations."""
