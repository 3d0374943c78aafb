"""Facts of a laboratory, as a certificate of the tests states them."""

TEXT = """
identifier = "K-2026-001"
begun = 2026-01-01
[laboratory]
name = "Bench & Söhne <Lab>"
country = "UA"
city = "Київ"
street = "Main"
[customer]
name = "A customer"
country = "DE"
city = "Braunschweig"
[[people]]
name = "Ann"
role = "head of laboratory"
main_signer = true
[[equipment]]
name = "rate table"
serial = "T-1"
certificate = "PTB 12345"
"""
"""TOML of the command that makes a certificate."""
