"""Repeatability of calibrations: from launch to launch, and from mounting to mounting."""
