"""How a recording is shown: a layout as Rerun's blueprint."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from .. import schema
from ..layout import Curves, Layout

GREY = (150, 155, 165)
_LEGEND_FITS = 12


def blueprint(layout: Layout) -> rrb.Blueprint:
    """Return Rerun's form of a layout."""
    rows = [_tabs([_plot(curves) for curves in row]) for row in layout.rows]
    about = rrb.TextDocumentView(origin=schema.ABOUT, name="About this run")
    scene = [] if layout.camera is None else [_scene(layout)]
    left = rrb.Tabs(*scene, about, rrb.TextLogView(origin=schema.EVENTS, name="Events"), active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(left, rrb.Vertical(*rows), column_shares=[3, 2]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline=schema.SIM_TIME,
            playback_speed=layout.speed,
            loop_mode="all",
            play_state="playing",
        ),
        auto_views=False,
        auto_layout=False,
    )


def _tabs(views: list):
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)


def _scene(layout: Layout) -> rrb.Spatial3DView:
    # A range of visible time counts for the entity that it names, not for those below it.
    past = rrb.VisibleTimeRange(
        schema.SIM_TIME,
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-layout.trail_seconds),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    overrides = {}
    for name, shown in layout.trails:
        behaviour = [] if shown else [rrb.EntityBehavior(visible=False)]
        overrides[f"{schema.TRAILS}/{name}"] = [rrb.VisibleTimeRanges([past]), *behaviour]
    overrides |= {folder: rrb.EntityBehavior(visible=False) for folder, shown in layout.folders if not shown}
    plane = rr.components.Plane3D.XY if layout.planar else rr.components.Plane3D([0.0, 0.0, 1.0])
    camera = layout.camera
    return rrb.Spatial3DView(
        origin=schema.WORLD,
        name="Scene",
        overrides=overrides,
        line_grid=rrb.LineGrid3D(visible=True, spacing=layout.grid, plane=plane, color=(*GREY, 40)),
        eye_controls=rrb.EyeControls3D(position=camera.eye, look_target=camera.target, eye_up=camera.up),
    )


def _plot(curves: Curves) -> rrb.TimeSeriesView:
    overrides = {curves.path: rr.SeriesLines(visible_series=list(curves.shown))} if curves.shown else {}
    return rrb.TimeSeriesView(
        origin=curves.path,
        overrides=overrides,
        name=curves.title,
        plot_legend=rrb.PlotLegend(visible=len(curves.names) <= _LEGEND_FITS),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
    )
