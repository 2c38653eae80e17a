#!/usr/bin/env python3
"""Checks that the prose of the project is within the limits of scripts/prose."""
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

if __name__ == "__main__":
    sys.exit(subprocess.run([sys.executable, ROOT / "scripts" / "prose", "--check"], check=False).returncode)
