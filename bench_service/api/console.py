"""Modules with the routes behind the console's own pages."""

from bench_service.api import certificates
from bench_service.api.jobs import estimates
from bench_service.api.units import notes

PARTS = (certificates, estimates, notes)
