"""Bags of ROS 1 and ROS 2: three containers, one way to take the fields of many messages at once (`messages`)."""
