"""Simulated three-axis table: profiles, its own kinematics, MuJoCo plant, device."""
