"""SQL of accounts, tokens, sessions and approvals."""
