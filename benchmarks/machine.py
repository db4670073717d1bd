"""What the measurements were made on, in words."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path


def processor() -> str:
    """Model, family and instruction sets of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    fields = dict((part.strip() for part in line.split(":", 1)) for line in lines if ":" in line)
    name = fields.get("model name", platform.machine())
    flags = fields.get("flags", "").split()
    sets = [wanted for wanted in ("avx2", "fma", "avx512f") if wanted in flags]
    kind = f"family {fields.get('cpu family', '?')} model {fields.get('model', '?')}"
    return f"{name} ({kind}; {', '.join(sets) or 'no vector extensions known'})"


def caches() -> str:
    """Sizes of the caches that core 0 sees."""
    found = []
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        try:
            kind = (index / "type").read_text().strip()
            if kind != "Instruction":
                level, size = ((index / part).read_text().strip() for part in ("level", "size"))
                found.append(f"L{level} {size}")
        except OSError:
            continue
    return ", ".join(found) or "unknown"


def compiler_version(path: str) -> str:
    """First line of what the compiler says of itself."""
    done = subprocess.run([path, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.splitlines()[0] if done.stdout else path


def version(package: str) -> str:
    """Version of an installed package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "absent"


def describe(compiler: str | None) -> list[str]:
    """Lines that describe processor, memory, system, compiler and packages."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    packages = ("foldyn", "numba", "llvmlite", "numpy", "scipy", "jax")
    return [
        f"processor: {processor()}, {os.cpu_count()} cores seen, caches {caches()}",
        f"memory: {memory:.0f} GiB; system: {platform.system()} {platform.release()}",
        f"C++: {compiler_version(compiler) if compiler else 'no compiler'}",
        f"Python {platform.python_version()}; "
        + ", ".join(f"{name} {version(name)}" for name in packages),
    ]
