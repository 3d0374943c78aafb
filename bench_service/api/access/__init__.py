"""Authentication and rights of requests, and the routes of session, accounts, tokens and approvals."""
