"""Files that hold arrays by name: MATLAB, HDF5, TDMS. Arrays of one length belong together (`tables`)."""
