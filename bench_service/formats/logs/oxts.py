"""Columns of a sample of KITTI's oxts, which has no names in its files."""

_PLACE = ("lat", "lon", "alt", "roll", "pitch", "yaw", "vn", "ve", "vf", "vl", "vu")
_MOTION = ("ax", "ay", "az", "af", "al", "au", "wx", "wy", "wz", "wf", "wl", "wu")
_QUALITY = ("pos_accuracy", "vel_accuracy", "navstat", "numsats", "posmode", "velmode", "orimode")
OXTS = (*_PLACE, *_MOTION, *_QUALITY)
SOURCE = "dataformat.txt of KITTI's raw data: the vehicle's x (forward), y (left), z (up)"
