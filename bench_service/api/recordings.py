"""Recordings: what there is, the samples out, and a recorded file in."""
from fastapi import APIRouter
router = APIRouter(prefix="/api/v1/recordings", tags=["recordings"])
