"""Position programs of a three-axis table, as text in the controller's language and as positions with their dwells."""
