"""Routes and schemas of benches: their state, their queues and their stops."""
