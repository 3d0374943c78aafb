"""Routes behind the console's own pages, as one router."""

from fastapi import APIRouter

from bench_service.api import certificates
from bench_service.api.jobs import estimates

router = APIRouter()
router.include_router(certificates.router)
router.include_router(estimates.router)
