"""Whether this machine can draw in 3D, and how fast: asked once, before the first canvas."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext

_GL_RENDERER = 0x1F01
_GL_VERSION = 0x1F02
_SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "gdi generic", "software rasterizer")
MINIMUM_VERSION = (2, 1)


@dataclass(frozen=True)
class GlSupport:
    """renderer: what draws, as the driver calls it. software: the processor draws, slowly.

    reason: why there is no 3D view and what to do, empty where there is one.
    """

    renderer: str = ""
    software: bool = False
    reason: str = ""


_support: GlSupport | None = None


def gl_support() -> GlSupport:
    """The machine's OpenGL, asked on the first call. Needs a QGuiApplication; never raises."""
    global _support
    if _support is None:
        _support = _probe()
    return _support


def _probe() -> GlSupport:
    platform = QGuiApplication.platformName()
    if platform in ("offscreen", "minimal", "linuxfb", "vnc"):
        return GlSupport(reason=f"The display platform “{platform}” has no OpenGL. Start Phalanx on a desktop.")
    surface = QOffscreenSurface()
    surface.create()
    context = QOpenGLContext()
    if not context.create() or not context.makeCurrent(surface):
        return GlSupport(
            reason="This machine offers no OpenGL. Install a graphics driver, or Mesa (libgl1, libegl1) to draw "
            "with the processor, and start Phalanx again."
        )
    try:
        functions = context.functions()
        renderer = str(functions.glGetString(_GL_RENDERER) or "unknown")
        version = str(functions.glGetString(_GL_VERSION) or "0.0")
    finally:
        context.doneCurrent()
    numbers = version.split()[0].split(".")
    if not all(n.isdigit() for n in numbers[:2]) or tuple(int(n) for n in numbers[:2]) < MINIMUM_VERSION:
        needed = ".".join(map(str, MINIMUM_VERSION))
        return GlSupport(
            renderer, reason=f"The graphics driver offers OpenGL {version}; {needed} is needed. Update the driver."
        )
    return GlSupport(renderer, any(name in renderer.lower() for name in _SOFTWARE_RENDERERS))
