"""A short plan of a thermal cycle."""


def leg(target_c: float) -> dict[str, float]:
    return {"target_c": target_c, "ramp_c_min": 5.0, "least_soak_s": 1200.0, "longest_s": 14_400.0}


SHORT = {
    "legs": [leg(20.0), leg(-20.0), leg(50.0)],
    "soak": {"slope_c_min": 0.3},
    "power_off_s": 1800.0,
    "sample_rate_hz": 1.0,
}
