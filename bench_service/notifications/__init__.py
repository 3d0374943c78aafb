"""Messages to people: verdicts, stops, prompts, failed nights and a full disk, by mail and webhook.

A message is written to a file before it is sent, tried until it is delivered or a day old, and a bench that has much to
say sends a digest instead of a flood.
"""
