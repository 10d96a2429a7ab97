"""Figures: the only subpackage that imports matplotlib. Every function returns a `Figure`."""

from contactlib.figures.animation import animate_runs
from contactlib.figures.diagram import run_diagram
from contactlib.figures.errors import sensor_errors
from contactlib.figures.files import save, save_pictures
from contactlib.figures.maps import draw_maps, map_figure
from contactlib.figures.paper import (
    CONTACT_PATCH,
    PAPER_FIGURES,
    PaperFigure,
    figure_1,
    figure_2,
    figure_3,
    figure_4,
    figure_5,
    figure_6,
)
from contactlib.figures.patch import contact_patches
from contactlib.figures.rails import rails_from_log
from contactlib.figures.runs import creep_curve, fold_diagram, time_histories
from contactlib.figures.scenario import Units, comparison, run_name, scenario_run
from contactlib.figures.stability import STABILITY_FIGURES
from contactlib.figures.stops import stopping_distances
from contactlib.figures.style import (
    captions,
    drivetrain_setting,
    page_size,
)
from contactlib.figures.vehicle import vehicle_creep_curve

__all__ = [
    "CONTACT_PATCH",
    "PAPER_FIGURES",
    "STABILITY_FIGURES",
    "PaperFigure",
    "Units",
    "animate_runs",
    "captions",
    "comparison",
    "contact_patches",
    "creep_curve",
    "draw_maps",
    "drivetrain_setting",
    "figure_1",
    "figure_2",
    "figure_3",
    "figure_4",
    "figure_5",
    "figure_6",
    "fold_diagram",
    "map_figure",
    "page_size",
    "rails_from_log",
    "run_diagram",
    "run_name",
    "save",
    "save_pictures",
    "scenario_run",
    "sensor_errors",
    "stopping_distances",
    "time_histories",
    "vehicle_creep_curve",
]
