"""Values of temperature corrections: of the unit's thermometers, and of gyros that depend on temperature."""
