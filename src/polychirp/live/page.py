"""The live page and its server, on this machine only."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from nicegui import app, run, ui
from starlette.middleware.base import BaseHTTPMiddleware

from polychirp.errors import PolychirpError
from polychirp.live import plots
from polychirp.live.controls import Controls
from polychirp.live.copies import script_text, study_text
from polychirp.live.look import Look, Stop, Stopped, detections_in, look_at, notes_on
from polychirp.live.presets import FIRST_PRESET, PRESETS
from polychirp.live.settings import LiveSettings, study_of
from polychirp.live.street_scene import LEGEND, draw_street, look_from_behind
from polychirp.study.trial import VictimResult

HOST: Final = "127.0.0.1"
"""The only address that the server listens on."""

POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self'; worker-src 'self' blob:"
)
"""Content security policy: a browser that keeps it sends no request to another machine."""

STYLE: Final = """
.polychirp-grid { display: grid; gap: 12px; width: 100%;
  grid-template-columns: minmax(280px, 340px) minmax(0, 1fr) minmax(0, 1fr); }
.polychirp-controls { grid-row: span 2; }
@media (max-width: 1000px) {
  .polychirp-grid { grid-template-columns: minmax(0, 1fr); }
  .polychirp-controls { grid-row: auto; order: 1; }
  .polychirp-later { order: 2; }
}
.polychirp-plot { width: 100%; height: 340px; }
h1 { font-size: 18px; font-weight: 700; line-height: 1.3; margin: 0; }
.polychirp-grid h2 { font-size: 15px; font-weight: 600; margin: 0 0 4px; line-height: 1.3; }
"""

LONGEST_ANSWER: Final = 5.0
"""Time for which the page waits for the browser's preference for dark pages, s. Chosen: a browser
that begins on a busy machine takes 2 s to run scripts."""

HINT: Final = (
    "While you change settings, vehicles are a few points each; 'trace it' computes bodies, "
    "mirrors and bounces."
)


class LivePage:
    """The page of one browser: its settings, and the newest look at them."""

    def __init__(self) -> None:
        self.settings = PRESETS[FIRST_PRESET]
        self.look: Look | None = None
        self.seen: VictimResult | None = None
        self.is_busy = False
        self.is_stale = False
        ui.add_css(STYLE)
        ui.add_head_html("<script>document.documentElement.lang = 'en'</script>")
        ui.colors(primary="#0b4f8a")
        self.dark = ui.dark_mode(value=False)
        self._build_header()
        with ui.element("div").classes("polychirp-grid p-3"):
            with ui.element("section").classes("polychirp-controls"):
                self.status = (
                    ui.label("computing the first picture …")
                    .classes("text-sm")
                    .props("role=status")
                )
                self.notes = ui.label().classes("text-xs")
                self.controls = Controls(self._change)
                ui.button("trace it", on_click=self._trace).props("outline no-caps")
                ui.label(HINT).classes("text-xs")
            with _panel("Street"):
                self.view = ui.scene(height=340, grid=False, background_color="#dfe6ea")
                self.view.classes("w-full")
                ui.label(LEGEND).classes("text-xs")
            self.profile = _plot("Power over range")
            self.map = _plot("Power over range and range rate", is_later=True)
            self.spectrogram = _plot("IF samples: beat over time", is_later=True)
        self.controls.show(self.settings)
        ui.timer(0.05, self._first, once=True)

    def _build_header(self) -> None:
        with ui.header(elevated=False).classes("items-center gap-3 py-2"):
            ui.html("<h1>polychirp live</h1>", sanitize=False)
            ui.select(
                list(PRESETS), value=FIRST_PRESET, on_change=lambda e: self._preset(e.value)
            ).props('dense outlined dark aria-label="preset"').classes("min-w-[230px]")
            ui.space()
            for label, on_click in (
                ("copy as study file", lambda: self._copy(study_text)),
                ("copy as Python", lambda: self._copy(script_text)),
                ("light / dark", self._toggle_dark),
            ):
                ui.button(label, on_click=on_click).props("flat dense no-caps color=white")

    # ── changes ─────────────────────────────────────────────────────────────

    async def _first(self) -> None:
        wants_dark = "window.matchMedia('(prefers-color-scheme: dark)').matches"
        with suppress(TimeoutError):  # a busy browser; the page is light then
            self.dark.value = bool(await ui.run_javascript(wants_dark, timeout=LONGEST_ANSWER))
        await self._refresh()
        self._move_camera()

    async def _preset(self, name: str) -> None:
        self.settings = PRESETS[name]
        self.controls.show(self.settings)
        await self._refresh()
        self._move_camera()

    def _move_camera(self) -> None:
        if self.look is not None:
            look_from_behind(self.view, self.look)

    def _change(self, settings: LiveSettings) -> None:
        self.settings = settings
        ui.timer(0.0, self._refresh, once=True)

    def _toggle_dark(self) -> None:
        self.dark.value = not self.dark.value
        self._draw()

    def _copy(self, text_of: Callable[..., str]) -> None:
        traced = study_of(self.settings, is_traced=True)
        is_traced = self.look is not None and self.look.study == traced
        ui.clipboard.write(text_of(self.settings, is_traced=is_traced))
        ui.notify("copied")

    # ── looks ───────────────────────────────────────────────────────────────

    async def _refresh(self) -> None:
        """Look at the newest settings; looks that are out of date are not begun."""
        self.is_stale = True
        if self.is_busy:
            return
        self.is_busy = True
        try:
            while self.is_stale:
                self.is_stale = False
                await self._look_once()
        except PolychirpError as error:
            self.status.text = str(error)
        finally:
            self.is_busy = False

    async def _look_once(self) -> None:
        """Show a look as soon as it is made, and its detections when they are found."""
        look = await run.io_bound(look_at, study_of(self.settings))
        if look is None:  # the server ends
            return
        self._show(look, None, f"simulated in {1e3 * look.seconds:.0f} ms; detecting …")
        if self.is_stale:
            return
        seen = await run.io_bound(detections_in, look)
        if seen is not None and not self.is_stale:
            self._show(look, seen, _summary(seen, look))
            notes = await run.io_bound(notes_on, look.study)
            self.notes.text = "; ".join(notes or ())

    def _show(self, look: Look, seen: VictimResult | None, status: str) -> None:
        if look is not self.look:
            draw_street(self.view, look)
        self.look, self.seen, self.status.text = look, seen, status
        self._draw()

    def _draw(self) -> None:
        if self.look is None:
            return
        is_dark = bool(self.dark.value)
        for element, figure in (
            (self.profile, plots.range_profile(self.look, self.seen, is_dark=is_dark)),
            (self.map, plots.range_rate(self.look, self.seen, is_dark=is_dark)),
            (self.spectrogram, plots.beats_over_time(self.look, is_dark=is_dark)),
        ):
            element.update_figure(figure)

    async def _trace(self) -> None:
        """Trace the street with bodies; a dialog shows progress and can stop it."""
        stop, state = Stop(), {"text": "starting", "share": 0.0}

        def note(what: str, done: int, total: int) -> None:
            state.update(text=f"{what} {done}/{total}", share=done / max(1, total))

        with ui.dialog().props("persistent") as dialog, ui.card():
            ui.label().bind_text_from(state, "text")
            ui.linear_progress(show_value=False).bind_value_from(state, "share")
            ui.button("stop", on_click=stop.press).props("no-caps")
        dialog.open()
        try:
            study = study_of(self.settings, is_traced=True)
            look = await run.io_bound(look_at, study, progress=stop.noticed_by(note))
            if look is None:
                return
            note("detecting", 1, 1)
            seen = await run.io_bound(detections_in, look)
            if seen is not None:
                self._show(look, seen, f"traced: {_summary(seen, look)}")
        except Stopped:
            ui.notify("stopped")
        except PolychirpError as error:
            self.status.text = str(error)
        finally:
            dialog.close()


def _panel(title: str, *, is_later: bool = False) -> Any:
    """A section with a title; a later one comes after the controls on narrow screens."""
    panel = ui.element("section").props(f'aria-label="{title}"')
    panel.classes("polychirp-later" * is_later)
    with panel:
        ui.html(f"<h2>{title}</h2>", sanitize=False)
    return panel


def _plot(title: str, *, is_later: bool = False) -> Any:
    with _panel(title, is_later=is_later):
        return ui.plotly({"data": []}).classes("polychirp-plot")


def _summary(seen: VictimResult, look: Look) -> str:
    """Targets found, missed and ghosts in one line."""
    found, missed = int(seen.score.is_detected.sum()), seen.score.num_missed
    ghosts = len(seen.score.ghosts)
    return (
        f"{found} found, {missed} missed, {ghosts} ghost{'s' * (ghosts != 1)}; simulated in "
        f"{1e3 * look.seconds:.0f} ms"
    )


class _Policy(BaseHTTPMiddleware):
    """Adds the content security policy to every answer."""

    async def dispatch(self, request: Any, call_next: Any) -> Any:
        response = await call_next(request)
        response.headers["Content-Security-Policy"] = POLICY
        return response


def serve(*, port: int, opens_browser: bool) -> None:
    """Serve the page until the program is interrupted."""
    app.add_middleware(_Policy)
    ui.page("/", title="polychirp live")(LivePage)
    if opens_browser:
        app.on_startup(lambda: webbrowser.open(f"http://{HOST}:{port}"))
    ui.run(
        host=HOST,
        port=port,
        show=False,
        reload=False,
        show_welcome_message=False,
        title="polychirp live",
    )
