"""The explorer page as a visitor has it, driven by its own controls, against Python's analysis."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from explorer_page import Found, explorer_page
from explorer_vehicle import SAMPLE, SPEED, changed, fold_of
from explorer_visitor import SELDOM, Visitor, assert_shows

import contactlib as cl
from contactlib import stability
from contactlib.vehicle import CreepCurve

pytestmark = pytest.mark.tools

NO_CHANGES: Mapping[str, float] = {}
WEAK = {"k_hat": 0.6, "ratio": 3.5}  # friction falls further and over a shorter way


@pytest.fixture(scope="module")
def visitor() -> Iterator[Visitor]:
    with explorer_page(clock_stands=True, color_scheme="light", accept_downloads=True) as opened:
        yield Visitor(opened)


class Setting(NamedTuple):
    """What a visitor sets up: a model and entries, in the units of the fields."""

    model: str
    ellipse: bool = False
    entries: Mapping[str, float] = NO_CHANGES

    def wheelset(self, request: pytest.FixtureRequest) -> cl.Wheelset:
        model: cl.Model = request.getfixturevalue(self.model)
        return changed(model.wheelset, self.entries, self.ellipse)

    def set_up(self, visitor: Visitor) -> None:
        visitor.choose({"rig": "roller_rig", "locomotive": "locomotive"}[self.model])
        visitor.check("Ellipse" if self.ellipse else "Line")
        visitor.enter(**self.entries)


RIG, LOCOMOTIVE = Setting("rig"), Setting("locomotive", True)
ELLIPSE = Setting("rig", True, WEAK)
SETTINGS = pytest.mark.parametrize(
    "setting", [RIG, LOCOMOTIVE, ELLIPSE], ids=["rig", "locomotive", "ellipse"]
)


def begin_at(visitor: Visitor, torque: float) -> None:
    """At rest under a torque [N.m]."""
    visitor.enter(rate=1e3, torque=1e-3 * torque)
    visitor.press("Reset")


# ---- slip-away and return --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "part"), [("roller_rig", 0.0), ("locomotive", 0.95), ("roller_rig", 1.05)]
)
def test_reset_returns_to_grip(visitor: Visitor, model: str, part: float) -> None:
    """Under the present torque, or under nine tenths of the critical one if it has no grip."""
    visitor.choose(model)
    fold = visitor.state("shown.fold")
    visitor.enter(rate=1e5, torque=1.05e-3 * fold["drive_torque"])
    assert "slip_away" in visitor.simulate(4.0).names
    visitor.enter(torque=1e-3 * part * fold["drive_torque"])
    visitor.press("Reset")
    if part > 1.0:
        assert "No grip holds that torque: the run starts at nine tenths" in visitor.toast()
        visitor.wait(10_000)
    assert 0.0 <= visitor.state("run.now.creepage") < fold["creepage"]
    torque = (part if part < 1.0 else 0.9) * fold["drive_torque"]
    assert visitor.state("run.now.drive_torque") == pytest.approx(torque, rel=1e-3)
    assert visitor.simulate(1.0).highest < fold["creepage"]


def test_the_speed_limit_stops_time_and_not_the_state(visitor: Visitor) -> None:
    """Play goes on from there, and grip comes back only below the torque of the return."""
    LOCOMOTIVE.set_up(visitor)
    visitor.enter(rate=10.0, torque=1.05e-3 * visitor.state("shown.fold")["drive_torque"])
    visitor.simulate(30.0)
    for _ in range(2):
        assert "above the limit of" in visitor.state("run.stopped")
        before = visitor.state("run.now")
        assert visitor.simulate(1.0).time == before["time"]
        visitor.press("Play")
        assert visitor.simulate(30.0).lowest >= 0.9 * before["creepage"]
        assert visitor.state("run.now.creepage") > before["creepage"]
    visitor.look()
    fold = visitor.state("shown.fold")
    holding = re.search(r"less than ([0-9.]+) kN m slows the wheel down", visitor.text("warning"))
    assert holding is not None
    assert fold["return_torque"] < 1e3 * float(holding[1]) < fold["drive_torque"]
    visitor.enter(torque=5e-4 * (fold["drive_torque"] + fold["return_torque"]))
    before = visitor.state("run.now")
    visitor.press("Play")
    assert visitor.state("run.now") == before
    passed = visitor.simulate(1.0)
    assert passed.time == pytest.approx(before["time"] + 1.0)
    assert passed.names == []
    assert passed.lowest > 0.9 * before["creepage"]
    visitor.enter(torque=0.5e-3 * fold["return_torque"])
    assert "returned" in visitor.simulate(30.0, until="returned").names


def test_a_start_from_grip_is_reported(visitor: Visitor) -> None:
    """A speed below the vehicle's least leaves nothing from which it could go on."""
    LOCOMOTIVE.set_up(visitor)
    lowest = visitor.state("settings.vehicle.minimum_speed")
    visitor.enter(rate=1e5, torque=0.0, speed=1.05 * lowest)
    visitor.simulate(60.0)
    assert "below the minimum" in visitor.toast()
    assert "Play starts again with grip" in visitor.toast()
    visitor.press("Play")
    assert "The run starts again with grip" in visitor.toast()
    assert visitor.state("run.stopped") is None


def test_a_run_begins_when_it_is_started() -> None:
    with explorer_page(clock_stands=True) as opened:
        visitor = Visitor(opened)

        def time() -> Any:
            for _ in range(3):
                visitor.wait(SELDOM)
            return visitor.state("run.now.time")

        assert time() == 0.0
        visitor.choose("locomotive")
        visitor.press("Reset")
        visitor.enter(torque=20.0)
        assert time() == 0.0
        visitor.press("Play")
        assert time() > 0.0
        visitor.press("Reset")  # and goes on
        assert time() > 0.0
        visitor.press("Pause")
        visitor.press("Reset")
        assert time() == 0.0
        visitor.press("Wet patch")
        assert time() > 0.0


def test_a_field_shows_three_digits_of_what_nobody_has_entered(visitor: Visitor) -> None:
    visitor.choose("locomotive")
    field = visitor.page.locator("#load-field")
    assert field.input_value() == "221"
    field.focus()
    assert field.input_value() == "220.65"
    field.blur()
    assert field.input_value() == "221"
    visitor.enter(load=200.12, speed=10.0)
    visitor.page.locator("#speed-field").blur()
    assert field.input_value() == "200.12"
    visitor.simulate(1.0)
    visitor.look()  # the time on the patch follows the speed
    fields = visitor.page.locator("input[type=text]:visible")
    shown = [fields.nth(i).input_value() for i in range(fields.count())]
    assert all(len(text.replace(".", "").lstrip("-0")) <= 3 for text in shown if text != "200.12")


def test_a_paused_page_shows_what_is_entered(visitor: Visitor, rig: cl.Model) -> None:
    RIG.set_up(visitor)
    visitor.enter(torque=24.0)
    visitor.press("Reset")

    def shown() -> dict[str, str]:
        for _ in range(3):
            visitor.wait(SELDOM)
        return visitor.numbers()

    visitor.look()
    assert shown()["drive torque T"] == "24.0 kN m"
    chart = visitor.call(PIXELS, "s-curve")
    visitor.enter(torque=26.0)
    assert shown()["drive torque T"] == "24.0 \u2192 26.0 kN m"
    assert visitor.call(PIXELS, "s-curve") != chart
    visitor.check("Creep control")
    for reference in (1.0, 2.4):
        visitor.enter(reference=reference)
        pole = CreepCurve(rig.wheelset, speed=SPEED).pole(1e-2 * reference)
        assert_shows(shown()["pole at the reference"], float(pole))


# ---- the wet patch --------------------------------------------------------------------------


def test_the_page_reports_what_a_patch_will_do(visitor: Visitor) -> None:
    RIG.set_up(visitor)
    visitor.look()
    text = visitor.text("clearing")
    time = float(text.removeprefix("Critical clearing time ").split(" ms")[0])
    for part, outcome in ((0.9, "will re-adhere"), (1.1, "will slip away")):
        visitor.enter(wet_time=part * time)
        visitor.look()
        assert outcome in visitor.text("clearing")
    begin_at(visitor, 0.0)
    visitor.look()
    assert "survives a patch of any length" in visitor.text("clearing")


# ---- memory ---------------------------------------------------------------------------------


def test_memory_is_switched_on_where_the_contact_can_have_it(visitor: Visitor) -> None:
    LOCOMOTIVE.set_up(visitor)
    visitor.look()
    clearing, numbers = visitor.text("clearing"), visitor.numbers()
    visitor.check("Memory")
    visitor.look()
    assert (visitor.text("clearing"), visitor.numbers()) == (clearing, numbers)
    visitor.press("Play")
    visitor.wait(1000)
    assert "memory=true" in visitor.call("() => location.href")
    visitor.page.get_by_role("radio", name="Line", exact=True).click(force=True)  # it stays off
    assert "needs a line contact of at least 4 semi-widths" in visitor.toast()
    assert visitor.page.get_by_role("radio", name="Ellipse").is_checked()
    visitor.enter(torque=28.0)
    assert "slip_away" in visitor.simulate(5.0, until="slip_away").names
    visitor.choose("locomotive")
    visitor.check("Memory")  # with it, the wheel can stand
    visitor.enter(speed=0.0)
    visitor.press("Reset")
    assert visitor.simulate(0.1).speed > 0.0  # it starts
    visitor.press("Reset")
    visitor.look()
    assert visitor.page.locator("#wet-time-field").input_value() == "\u221e"
    visitor.press("Slip-away")
    assert visitor.text("story").startswith("Here the wheel stands")
    visitor.page.get_by_role("radio", name="No memory", exact=True).click(force=True)
    assert visitor.toast() == "speed without memory = 0 is out of range: must be finite and >= 0.1"
    visitor.enter(speed=10.0)
    visitor.check("No memory")
    visitor.check("Line")
    assert visitor.state("settings.vehicle.contact") == "line"


# ---- numbers --------------------------------------------------------------------------------


class Point(NamedTuple):
    """A setting, with what else is entered."""

    setting: Setting
    speed: float = SPEED
    load: float = 220.65  # [kN]
    reference: float | None = None  # [%]; None: torque control
    delay: float = 0.0  # [ms]


ALL_ELSE = {
    "k_hat": 0.2,
    "ratio": 3.0,
    "kinetic": 0.25,
    "slope": 0.05,
    "residual": 0.5,
    "decay": 0.4,
    "inertia": 120.0,
    "damping": 200.0,
}
POINTS = {
    "locomotive, heavy and fast": Point(LOCOMOTIVE, speed=20.0, load=300.0),
    "all else": Point(Setting("rig", entries=ALL_ELSE), load=100.0),
    "creep control of an ellipse": Point(ELLIPSE, reference=3.0, delay=2.0),
    "too late": Point(RIG, reference=2.2, delay=30.0),
}


@pytest.mark.parametrize("name", POINTS)
def test_numbers_shown_are_those_of_python(
    visitor: Visitor, name: str, request: pytest.FixtureRequest
) -> None:
    setting, speed, load, reference, delay = POINTS[name]
    wheelset = setting.wheelset(request)
    setting.set_up(visitor)
    visitor.enter(speed=speed, load=load)
    if reference is not None:
        visitor.check("Creep control")
        visitor.enter(reference=reference, delay=delay)
    speed = visitor.simulate(0.05).speed
    visitor.look()
    numbers = visitor.numbers()
    creepage = visitor.state("run.now.creepage")
    at = creepage if reference is None else reference / 100.0
    here: dict[str, Any] = {"speed": speed, "axle_load": 1e3 * load}
    force = wheelset.element.at_creepage(creepage, **here)
    pole = float(CreepCurve(wheelset, **here).pole(at))
    gain = wheelset.element.radius / (wheelset.inertia * speed)
    fold = stability.find_fold(wheelset, **here | {"speed": visitor.state("shown.speed")})
    assert fold is not None
    for label, value in {
        "creepage \u03b6": 100.0 * creepage,
        "drive torque T": 1e-3 * visitor.state("run.now.drive_torque"),
        "Q / P": float(force["traction_coefficient"]),
        "pole here" if reference is None else "pole at the reference": pole,
        "critical torque": 1e-3 * fold.drive_torque,
        "re-adheres at": 1e-3 * fold.return_torque,
        "K at this load": float(force["k_hat"]),
        "\u03b6\u2080 at this load": 100.0 * float(force["saturation_creepage"]),
        "process zone": float(force["process_zone_ratio"]),
        "weakening length": 1e6 * wheelset.element.friction.weakening_length,
    }.items():
        assert_shows(numbers[label], value)
    window = stability.proportional_window(pole, gain, delay=1e-3 * delay, sample_time=SAMPLE)
    smallest = stability.creep_control_gain(wheelset, wheelset.balanced(creepage=at, **here))
    lowest, _, highest = numbers["Kp that hold it [MN m]"].partition(" \u2013 ")
    if smallest >= window.highest:
        assert lowest == "none"
    else:
        assert_shows(highest, 1e-6 * window.highest)
        if smallest <= 0.0:
            assert lowest == "0"
        else:
            assert_shows(lowest, 1e-6 * smallest)
    longest = numbers["longest delay"]
    if pole > 0.0:  # almost one over the pole, in whole samples
        assert 0.0 < float(longest.split()[0]) <= 1e3 / pole
    else:
        assert longest == "any"


LAYERED = """
name = "A wheel on a soft layer"
source = "chosen"
[contact]
semi_axis_x = 6e-3
semi_axis_y = 5e-3
wheel_load = 100e3
youngs_modulus = 210e9
poisson_ratio = 0.28
[friction]
static = 0.33
kinetic = 0.25
weakening_length = 5e-6
[wheelset]
radius = 0.45
layer_compliance = 1e-13
inertia = 120.0
wheels = 1
damping = 0.06
[run]
initial_speed = 10.0
"""


@pytest.mark.filterwarnings("ignore:process zone")
@pytest.mark.parametrize("mass", [None, 150e3])
def test_axes_follow_the_border_the_upper_state_and_the_wheel(
    visitor: Visitor, tmp_path: Path, mass: float | None
) -> None:
    text = LAYERED if mass is None else LAYERED.replace("[run]", f"mass = {mass}\n[run]")
    file = tmp_path / "layered.toml"
    file.write_text(text)
    wheelset = cl.load_model(str(file)).wheelset
    visitor.page.set_input_files("#model-file", file)
    visitor.page.get_by_text("layered.toml: A wheel on a soft layer").wait_for()
    fold = fold_of(wheelset)
    for part in (0.02, 0.6, 0.9):  # between return and fold
        torque = fold.return_torque + part * (fold.drive_torque - fold.return_torque)
        states = stability.steady_states(wheelset, drive_torque=torque, speed=SPEED)
        _, border, upper = creepages = states.creepage[-3:]  # of traction
        begin_at(visitor, torque)
        visitor.look()
        axes = visitor.state("shown.axes")
        assert 1.2 * border <= axes["far"] <= axes["horizon"]
        assert axes["highest"] >= max(10.0, upper)
        rests = visitor.state("rests")
        assert [rest["creepage"] for rest in rests] == pytest.approx(creepages, rel=1e-6)
        assert [rest["slope"] > 0.0 for rest in rests] == states.stable[-3:].tolist()
        label = visitor.page.locator("#patch [aria-label]").first.get_attribute("aria-label")
        assert "of its length stick" in str(label)
        visitor.enter(kick_size=100.0 * (axes["far"] + border))
        visitor.press("Kick the wheel")
        visitor.look()
        assert visitor.state("run.now.creepage") > border
        assert visitor.state("run.now.creepage") < visitor.state("shown.axes.horizon")
        assert visitor.state("shown.axes.far") == axes["far"]  # which the wheel does not move
    visitor.enter(kick_size=1.0)


@pytest.mark.parametrize(("ratio", "warned"), [(2.1, False), (2.0, True)])
def test_a_long_process_zone_is_warned_of(
    visitor: Visitor, rig: cl.Model, ratio: float, warned: bool
) -> None:
    zone = 2.0 * np.pi * rig.wheelset.element.k_hat**2 / (ratio - 1.0) ** 2
    assert (zone > 0.5) == warned
    RIG.set_up(visitor)
    visitor.enter(ratio=ratio)
    visitor.look()
    assert ("weakening zone" in visitor.text("warning")) == warned
    assert_shows(visitor.numbers()["process zone"], zone)


# ---- experiments ----------------------------------------------------------------------------

# Runs a story frame by frame until its last text; then some time more.
RUN_STORY = """async (after) => {
  const { app } = await contactlib.ready;
  const texts = [], steps = [];
  const last = app.story.steps.length;
  const text = () => document.getElementById("story").textContent;
  const pass = (duration) => {
    const step = steps.at(-1);
    step.events.push(...app.advance(duration).map(({ name }) => name));
    if (text() !== texts.at(-1)) return; // the next step has begun
    step.lowest = Math.min(step.lowest, app.run.now.creepage);
    step.highest = Math.max(step.highest, app.run.now.creepage);
    step.last = app.run.now.creepage;
  };
  for (let i = 0; i < 20000; i++) {
    if (text() !== texts.at(-1)) {
      texts.push(text());
      steps.push({ events: [], lowest: Infinity, highest: -Infinity, last: NaN });
    }
    if (texts.length === last) break;
    pass(app.settings.playback / 60);
  }
  for (let time = 0; time < after; time += 1e-3) pass(1e-3);
  const { stopped, now } = app.run, { name } = app.story;
  return { texts, steps, ...now, stopped, name, last };
}"""


ROWS = """async () => Object.fromEntries(Object.entries((await contactlib.ready)
  .app.run.history.window()).map(([name, values]) => [name, [...values]]))"""


def run_story(visitor: Visitor, setting: Setting, story: str, after: float) -> Found:
    setting.set_up(visitor)
    visitor.wait()
    visitor.press(story)
    played = Found(**visitor.call(RUN_STORY, after))
    assert len(played.texts) == played.last
    assert played.stopped is None
    button = visitor.page.get_by_role("button", name=story, exact=True)
    assert button.get_attribute("aria-pressed") == "true"
    return played


# Of each experiment: some time after its last text [s], and what happens in each of its steps, with
# the range of the creepage at the step's end over that of the fold.
FAR = (5.0, math.inf)
STORIES: dict[str, tuple[float, list[tuple[str, tuple[float, float]]]]] = {
    "Slip-away": (0.0, [("peak_passed", (0.9, 1.0)), ("slip_away", FAR), ("", FAR)]),
    "Hysteresis": (
        0.5,
        [("peak_passed slip_away", FAR), ("", FAR), ("returned", (1.0, 5.0)), ("", (0.0, 1.0))],
    ),
    "Kick it": (
        2.0,
        [
            ("", (0.7, 0.8)),
            ("peak_passed returned", (0.7, 0.8)),
            ("peak_passed", (2.0, 3.0)),
            ("slip_away", FAR),
        ],
    ),
    "Wet patch": (
        2.0,
        [
            ("", (0.6, 0.7)),
            ("patch_begins peak_passed patch_ends returned", (0.6, 0.7)),
            ("patch_begins peak_passed patch_ends", (1.6, 2.1)),
            ("slip_away", FAR),
        ],
    ),
    "Hold it": (0.5, [("", (0.74, 0.76)), ("peak_passed", (1.42, 1.48)), ("", (1.44, 1.46))]),
    "Too late": (
        2.0,
        [
            ("", (1.19, 1.21)),
            ("", (1.19, 1.21)),
            ("returned peak_passed", (0.3, 3.0)),
            ("returned peak_passed", (0.3, 3.0)),
        ],
    ),
}


@SETTINGS
@pytest.mark.parametrize("story", STORIES)
def test_an_experiment_shows_what_it_describes(
    visitor: Visitor, setting: Setting, story: str, request: pytest.FixtureRequest
) -> None:
    if (setting, story) == (LOCOMOTIVE, "Hysteresis"):  # it slips away beyond the limit of the rim
        setting.set_up(visitor)
        visitor.press(story)
        assert "rim speed" in visitor.text("story")
        return
    after, expected = STORIES[story]
    played = run_story(visitor, setting, story, after)
    fold = fold_of(setting.wheelset(request), played.speed)
    ends = [*(step["last"] for step in played.steps[:-1]), played.creepage]
    for step, end, (events, (low, high)) in zip(played.steps, ends, expected, strict=True):
        assert set(step["events"]) == set(events.split())
        assert low <= end / fold.creepage <= high


@SETTINGS
def test_a_wheel_that_stands_swings_as_on_the_spring_that_the_text_names(
    visitor: Visitor, setting: Setting, request: pytest.FixtureRequest
) -> None:
    """Its stiffness follows from force and displacement, its frequency from the inertia on it."""
    played = run_story(visitor, setting, "Spring", 0.1)
    time, moved, force = (
        np.array(visitor.call(ROWS)[name]) for name in ("time", "displacement", "creep_force")
    )
    comes, free = (time > 0.01) & (time < 0.05), time > played.time - 0.09
    stiffness = np.polyfit(moved[comes], force[comes], 1)[0]
    inverse = setting.wheelset(request).effective_inverse_mass
    frequency = math.sqrt(stiffness * inverse) / (2.0 * math.pi)
    numbers = [re.search(r"([\d.]+)\s(?:kN/|Hz)", text) for text in played.texts]
    shown = [float(number[1]) for number in numbers if number]
    assert shown == pytest.approx([1e-9 * stiffness, frequency], rel=0.02)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(moved[free]))))
    period = 2.0 * np.diff(time[free][turns]).mean()
    assert period * frequency == pytest.approx(1.0, rel=0.03)
    assert not any(step["events"] for step in played.steps)
    visitor.press("Reset")
    assert visitor.settings()["speed"] > 0.0
    assert not visitor.settings()["vehicle"]["memory"]


def test_the_experiment_of_the_wet_patch_finds_a_torque(visitor: Visitor) -> None:
    """Where nine tenths of the critical torque are less than that of the return."""
    played = run_story(visitor, Setting("rig", entries={"k_hat": 0.15}), "Wet patch", 2.0)
    fold = visitor.state("shown.fold")
    assert 0.9 * fold["drive_torque"] < fold["return_torque"] < played.drive_torque
    assert played.drive_torque < fold["drive_torque"]
    assert "patch_ends" in played.steps[1]["events"]
    assert played.creepage > fold["creepage"]


def test_an_experiment_that_cannot_begin_leaves_a_wheel_that_grips(visitor: Visitor) -> None:
    advice = "lower the wet friction"
    Setting("rig", entries={"wet_friction": 1.0}).set_up(visitor)
    visitor.press("Kick it")
    visitor.call(RUN_STORY, 2.0)
    visitor.wait(10_000)  # until the message of an earlier test is gone
    visitor.press("Wet patch")
    assert advice in visitor.text("story")
    assert visitor.state("run.now.creepage") < visitor.state("shown.fold")["creepage"]
    assert visitor.text("toast") == ""
    visitor.press("Reset")
    assert advice not in visitor.text("story")


# ---- keyboard and screen reader -------------------------------------------------------------

CONTROLS = "a[href], button, select, input:not([type=file])"
# Visible controls in the order of the page; of radio buttons the one that is chosen.
IN_ORDER = f"""() => [...document.querySelectorAll("{CONTROLS}")]
  .filter((e) => e.checkVisibility() && !e.closest("dialog") && (e.type !== "radio" || e.checked))
  .map((e) => e.id || e.value || e.textContent)"""
FOCUSED = """() => {
  const e = document.activeElement;
  return e === document.body ? null : e.id || e.value || e.textContent;
}"""


def test_tab_reaches_every_control_in_order_and_all_have_names(visitor: Visitor) -> None:
    RIG.set_up(visitor)
    roles = "button|textbox|slider|combobox|radio|region|group|figure|link|dialog|option"
    for mode in ("Torque", "Creep control"):
        visitor.check(mode)
        controls = visitor.call(IN_ORDER)
        assert len(set(controls)) == len(controls) > 30
        visitor.page.locator(".skip").focus()
        reached = [visitor.call(FOCUSED)]
        for _ in controls[1:]:
            visitor.page.keyboard.press("Tab")
            reached.append(visitor.call(FOCUSED))
        assert reached == controls
        tree = visitor.page.locator("body").aria_snapshot()
        assert len(re.findall(rf'^ *- (?:{roles}) "[^"]+"', tree, re.MULTILINE)) > 50
        assert re.findall(rf"^ *- (?:{roles})(?! \").*", tree, re.MULTILINE) == []


def test_a_live_region_names_what_happens(visitor: Visitor, rig: cl.Model) -> None:
    """In live regions, which screen readers follow."""
    for place in ("story", "warning", "toast", "spoken"):
        assert visitor.page.locator(f"#{place}:is([role=status], [aria-live=polite])").count() == 1
    torque = fold_of(rig.wheelset).drive_torque
    RIG.set_up(visitor)
    begin_at(visitor, 0.99 * torque)
    visitor.wait()
    visitor.enter(torque=1.02e-3 * torque)
    for event, words in (("peak_passed", "fold"), ("slip_away", "Slip-away")):
        visitor.simulate(5.0, until=event)
        assert words in visitor.text("spoken")


def test_keys_do_what_the_help_lists(visitor: Visitor) -> None:
    RIG.set_up(visitor)
    visitor.wait()
    visitor.look()
    visitor.page.mouse.click(2, 2)

    def pressed(key: str, name: str) -> Any:
        visitor.page.keyboard.press(key)
        return visitor.state(name)

    assert pressed(" ", "playing")
    assert not pressed(" ", "playing")
    before = visitor.state("run.now.creepage")
    kicked = pressed("k", "run.now.creepage") - before
    assert kicked == pytest.approx(visitor.state("kickSize"), rel=1e-9)
    assert pressed("w", "run.motion.patch")["friction"] == 0.5
    assert pressed("r", "run.now.time") == 0.0
    stories = visitor.page.locator("#stories button")
    assert stories.count() == 7
    for i in range(7):
        assert pressed(str(i + 1), "story.name") == stories.nth(i).inner_text()
    visitor.press("Slip-away")  # whatever was clicked, Space pauses and goes on
    for what in ("Slip-away", "Kick the wheel", "Reset"):
        visitor.press(what)
        begun, playing = visitor.simulate(0.01).time, visitor.state("playing")
        for now in (not playing, playing):
            assert pressed(" ", "playing") == now
            assert visitor.state("run.now.time") == begun, what
    visitor.page.locator("#stories button").first.focus()  # also after a key on an experiment
    visitor.page.keyboard.press(" ")
    begun = visitor.simulate(0.01).time
    assert not pressed(" ", "playing")
    assert visitor.state("run.now.time") == begun
    # Letters that are typed into a field are no commands.
    begun = visitor.simulate(0.01).time
    visitor.page.locator("#k-hat-field").focus()
    assert pressed("r", "run.now.time") == begun
    visitor.page.keyboard.press("Escape")
    assert visitor.page.locator("#k-hat-field").input_value() == "0.3"


SLIDERS = """(place) => [...document.querySelectorAll(`${place} input[type=range]`)]
  .map((e) => e.id)"""
KEYS = {"ArrowRight": 1, "PageUp": 1, "ArrowLeft": -1, "PageDown": -1}


@pytest.mark.parametrize(("mode", "place"), [("Torque", "main"), ("Creep control", "#drive")])
def test_keys_move_sliders_and_no_end_breaks_the_page(
    visitor: Visitor, mode: str, place: str
) -> None:
    RIG.set_up(visitor)
    visitor.check(mode)
    still = []
    for name in visitor.call(SLIDERS, place):
        RIG.set_up(visitor)
        visitor.check(mode)
        visitor.enter(wet_friction=0.5, residual=0.6, decay=0.5)
        if mode == "Creep control":
            visitor.enter(reference=1.5, delay=5.0)
        slider = visitor.page.locator(f"#{name}")
        field = visitor.page.locator(f"#{name.removesuffix('slider')}field")
        before = float(field.input_value())
        for key, sign in KEYS.items():
            slider.press(key)
            after = float(field.input_value())
            if np.sign(after - before) != sign:
                still.append((name, key, before, after))
            before = after
        assert str(slider.get_attribute("aria-valuetext")).startswith(field.input_value())
        for key in ("Home", "End"):
            slider.press(key)
            visitor.wait()
            time = visitor.state("run.now.time")
            assert visitor.simulate(0.02).time > time, (name, key)
            visitor.wait()
    assert still == []
    assert visitor.opened.errors == []


def test_a_finger_takes_the_torque_by_its_handle_only() -> None:
    with explorer_page(360, 740, clock_stands=True, has_touch=True) as opened:
        visitor = Visitor(opened)
        visitor.look()
        box = opened.page.locator("#s-curve .u-over").bounding_box()
        assert box is not None
        client = opened.page.context.new_cdp_session(opened.page)

        def drag(x: float, way: float) -> None:
            y = box["y"] + 0.5 * box["height"]
            for kind, points in (
                ("touchStart", [{"x": x, "y": y}]),
                ("touchMove", [{"x": x + 0.5 * way, "y": y}]),
                ("touchMove", [{"x": x + way, "y": y}]),
                ("touchEnd", []),
            ):
                client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        took = []
        for part in np.linspace(0.02, 0.98, 13):
            start = visitor.state("control.drive_torque")
            drag(box["x"] + part * box["width"], -10.0)
            took.append(visitor.state("control.drive_torque") != start)
            opened.call(
                "async (value) => { (await contactlib.ready).app.control.drive_torque = value; }",
                start,
            )
            visitor.look()
        assert 1 <= sum(took) <= 4  # of 13, beside each other: where the handle is
        assert sum(np.diff(took)) <= 2


def test_the_help_gives_the_focus_back(visitor: Visitor) -> None:
    dialog = visitor.page.get_by_role("dialog")
    for place, key in (("help-button", "Enter"), ("speed-slider", "?")):
        visitor.page.locator(f"#{place}").focus()
        visitor.page.keyboard.press(key)
        assert dialog.is_visible()
        assert "Space" in dialog.inner_text()
        visitor.page.keyboard.press("Escape")
        assert not dialog.is_visible()
        assert visitor.call(FOCUSED) == place


@pytest.mark.parametrize(
    ("entry", "typed", "problem"),
    [
        ("torque", "24 kNm", 'drive torque T: "24 kNm" is not a number'),
        ("torque", "", 'drive torque T: "" is not a number'),
        ("k-hat", "3", "drop of friction K must be finite and >= 0 and <= 2"),
        ("speed", "-1", "speed V must be finite and >= 0 and <= 100 m/s"),
        ("speed", "0", "speed without memory = 0 is out of range: must be finite and >= 0.1"),
        ("ratio", "0.5", "ratio f_s / f_d must be finite and >= 1 and <= 100"),
        ("wet-time", "-3", "time on the patch must be finite and >= 0.01 and <= 100000 ms"),
    ],
)
def test_a_field_refuses_and_names_what_it_takes(
    visitor: Visitor, entry: str, typed: str, problem: str
) -> None:
    """Entry and error stay together where the focus goes, and go together."""
    RIG.set_up(visitor)
    field = visitor.page.locator(f"#{entry}-field")
    shown = field.input_value()

    def assert_refused(text: str, why: str) -> None:
        assert (field.input_value(), visitor.text(f"{entry}-problem")) == (text, why)
        assert (field.get_attribute("aria-invalid") == "true") == bool(why)

    ways: tuple[Callable[[], object], ...] = (
        lambda: field.press("Escape"),
        lambda: visitor.press("Reset"),
        lambda: visitor.enter(inertia=251.0),
        lambda: visitor.page.locator("#residual-slider").press("ArrowLeft"),
        lambda: visitor.enter(**{entry.replace("-", "_"): float(shown)}),
    )
    for leave in ways:
        before = visitor.settings()
        field.fill(typed)
        field.press("Enter")
        assert_refused(typed, problem)
        field.press("Tab")
        assert_refused(typed, problem)
        assert visitor.settings() == before
        leave()
        field.blur()
        assert_refused(shown, "")


# ---- address and files ----------------------------------------------------------------------


def test_settings_survive_in_the_address(visitor: Visitor) -> None:
    ELLIPSE.set_up(visitor)
    visitor.enter(speed=12.5, load=180.0, wet_friction=0.4, inertia=321.0)
    visitor.check("Creep control")
    visitor.enter(reference=2.2, delay=3.0)
    visitor.wait(1000)
    address = visitor.call("() => location.href")
    with explorer_page(fragment=address.partition("#")[2], clock_stands=True) as opened:
        other = Visitor(opened)
        assert other.settings() == visitor.settings()
        assert other.page.locator("#k-hat-field").input_value() == "0.6"
        assert other.page.get_by_role("radio", name="Ellipse").is_checked()


def test_the_page_starts_with_any_address() -> None:
    fragment = "vehicle=locomotive&mass=1&linear=1e5&inertia=1e-12"
    words = ["inertia = 1e-12", ">= 0.001", "all of mass=1, linear=100000", "no grip"]
    with explorer_page(fragment=fragment) as opened:
        visitor = Visitor(opened)
        for _ in range(2):  # when it is opened, and when the address of an open page changes
            message = visitor.toast()
            assert all(part in message for part in words), message
            assert visitor.simulate(0.1).time >= 0.1
            visitor.call(
                """(fragment) => {
                  document.getElementById("toast").textContent = "";
                  location.hash = `#${fragment}&`;
                }""",
                fragment,
            )


def test_a_model_file_is_opened_or_refused(visitor: Visitor, tmp_path: Path) -> None:
    name = "<img src=x onerror='window.hit = 1'>"  # which is text, as any name
    text = Path("models/locomotive.toml").read_text()
    edited = re.sub('name = ".*"', f'name = "{name}"', text, count=1).replace("= 130.0", "= 213")
    path = tmp_path / "mine.toml"
    path.write_text(edited)
    RIG.set_up(visitor)
    for content, message in (
        (edited, f"mine.toml: {name}"),
        (edited.replace("kinetic = ", "kinetic = -"), r"friction.kinetic = -0.\d+ is out of range"),
    ):
        file: Any = {"name": "mine.toml", "mimeType": "text/plain", "buffer": content.encode()}
        visitor.page.set_input_files("#model-file", files=[file])
        assert re.search(message, visitor.toast())
        visitor.wait(10_000)
        visitor.look()
        fold = fold_of(cl.load_model(path).wheelset, visitor.state("shown.speed"))
        assert_shows(visitor.numbers()["critical torque"], 1e-3 * fold.drive_torque)
        assert visitor.page.locator("#preset option:checked").inner_text().startswith(name)
    assert visitor.page.locator("img").count() == 0
    assert visitor.call("() => window.hit ?? null") is None


@pytest.mark.parametrize(
    ("fragment", "chosen", "file"),
    [
        ("vehicle=locomotive", "Locomotive wheelset", "locomotive"),
        ("name=My%20wheelset", "My wheelset (link)", "my_wheelset"),
    ],
)
def test_a_saved_model_is_read_by_python(
    tmp_path: Path, fragment: str, chosen: str, file: str
) -> None:
    fragment += "&inertia=321&damping=12"
    with explorer_page(fragment=fragment, accept_downloads=True) as opened:
        assert opened.page.locator("#preset option:checked").inner_text().startswith(chosen)
        with opened.page.expect_download() as download:
            opened.page.get_by_role("button", name="Save model").click()
        assert download.value.suggested_filename == f"{file}_explored.toml"
        download.value.save_as(tmp_path / "saved.toml")
    saved = cl.load_model(tmp_path / "saved.toml").wheelset
    assert (saved.inertia, saved.damping) == (321.0, 12.0)


# ---- safety ---------------------------------------------------------------------------------


def test_nothing_but_the_page_s_own_script_runs_and_it_reaches_nothing() -> None:
    with explorer_page(clock_stands=True) as opened:
        effects = opened.call(
            """() => new Promise((resolve) => {
              const script = document.createElement("script");
              script.textContent = "window.hit = 'script'";
              document.body.append(script);
              const button = document.createElement("button");
              button.setAttribute("onclick", "window.hit = 'handler'");
              document.body.append(button);
              button.click();
              const { port1, port2 } = new MessageChannel();
              port1.onmessage = async () => {
                try { eval("window.hit = 'eval'"); } catch (error) { window.refused = error.name; }
                await fetch("https://example.com/").then(() => (window.hit = "fetch"), () => null);
                resolve([window.hit ?? null, window.refused ?? null]);
              };
              port2.postMessage(0);
            })"""
        )
        assert effects == [None, "EvalError"]
        assert len(opened.errors) >= 3
        assert all("Content Security Policy" in error for error in opened.errors), opened.errors
        opened.errors.clear()


# ---- look -----------------------------------------------------------------------------------

# One line for each element that goes beyond the page, overlaps a sibling or is cut.
FLAWS = """() => {
  const found = [], root = document.documentElement;
  const name = (e) => e.id || (e.textContent ?? String(e)).trim().slice(0, 30) || e.className ||
    e.tagName;
  const seen = (list) => [...list].filter((e) => e.checkVisibility() && e.getClientRects().length &&
    getComputedStyle(e).clipPath === "none");
  const all = (selector) => seen(document.querySelectorAll(selector));
  const apart = (elements) => {
    const boxes = elements.map((e) => e.getBoundingClientRect());
    boxes.forEach((a, i) => boxes.slice(0, i).forEach((b, j) => {
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const up = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > 0.5 && up > 0.5) found.push(`${name(elements[j])} and ${name(elements[i])}`);
    }));
  };
  if (root.scrollWidth > innerWidth) found.push(`page: ${root.scrollWidth} px wide`);
  const drive = document.getElementById("drive"); // which a phone keeps in sight, above the others
  drive.style.position = "static";
  const plot = ".plot, .plot *, .switch label, #toast"; // which lie one upon another
  for (const e of all("body, body *")) {
    const { left, right } = e.getBoundingClientRect();
    const chips = e.closest("#stories") !== null; // which scroll by themselves
    if (!chips && (left < -0.5 || right > innerWidth + 0.5) && !e.matches(".skip")) {
      found.push(`${name(e)}: from ${left} to ${right}`);
    }
    if (!e.matches(plot)) apart(seen(e.children).filter((child) => !child.matches(plot)));
  }
  apart(all("dt, dd").map((e) => {
    const text = document.createRange();
    text.selectNodeContents(e);
    return text;
  }));
  const side = document.querySelector(".side"), end = side.getBoundingClientRect().bottom;
  const whole = getComputedStyle(side).overflowY === "auto" && side.scrollTop === 0;
  for (const e of whole ? side.querySelectorAll("button, select, .row, .switch") : []) {
    const { top, bottom } = e.getBoundingClientRect();
    if (top < end - 0.5 && bottom > end + 0.5) found.push(`${name(e)}: cut at the bottom`);
  }
  const room = innerWidth > 640 ? innerHeight : innerHeight - drive.offsetHeight;
  const { top, bottom } = document.getElementById("history").getBoundingClientRect();
  if (bottom - top > room) found.push(`history: ${bottom - top} px high, of ${room}`);
  drive.style.position = "";
  for (const e of all("button, dt, dd, label, legend, figcaption, .note, .unit, #story, " +
      "#warning, input[type=text], h1, h2")) {
    if (getComputedStyle(e).display !== "inline" && e.scrollWidth > e.clientWidth + 1) {
      found.push(`${name(e)}: cut, ${e.scrollWidth} of ${e.clientWidth} px`);
    }
  }
  return found;
}"""
# Sizes of all kinds of text [px]: of elements, and on the charts.
TYPE_SIZES = """async () => [
  ...["label", "dt", "dd", "button", "figcaption", "small", ".note", ".unit", "#story"]
    .map((kind) => parseFloat(getComputedStyle(document.querySelector(`main ${kind}`)).fontSize)),
  ...(await contactlib.ready).app.stage.views.flatMap(({ chart: { plot } }) =>
    plot.axes.map(({ font }) => parseFloat(font[0]))),
  ...[...document.querySelectorAll("canvas.over, #above")].filter((e) => e.checkVisibility())
    .map((e) => parseFloat(e.getContext("2d").font.match(/[0-9.]+(?=px)/)[0])),
]"""
PIXELS = """(id) =>
  [...document.querySelectorAll(`#${id} canvas`)].map((e) => e.toDataURL()).join()"""


# Remembers where each canvas has text; then one line for each that is cut, overprints another or is
# struck through: by a line of its own canvas, or by one of the chart's curves below.
WATCH_TEXTS = """() => {
  const texts = new Map(), prototype = CanvasRenderingContext2D.prototype;
  const { clearRect, fillText, strokeText } = prototype;
  const cornersOf = (context, text, x, y) => {
    const m = context.measureText(text), to = context.getTransform();
    return [-m.actualBoundingBoxLeft, m.actualBoundingBoxRight].flatMap((dx) =>
      [-m.actualBoundingBoxAscent, m.actualBoundingBoxDescent].map((dy) =>
        to.transformPoint({ x: x + dx, y: y + dy })));
  };
  const boxOf = (corners) => {
    const xs = corners.map(({ x }) => x), ys = corners.map(({ y }) => y);
    return { left: Math.min(...xs), right: Math.max(...xs),
      top: Math.min(...ys), bottom: Math.max(...ys) };
  };
  // Pixels that are darker than grid and bands.
  const inked = (canvas, { left, right, top, bottom }) => {
    const { data } = canvas.getContext("2d").getImageData(left, top, right - left, bottom - top);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
      const lightest = Math.min(data[i], data[i + 1], data[i + 2]);
      if (255 - (data[i + 3] / 255) * (255 - lightest) < 205) count++;
    }
    return count;
  };
  let below = 0;
  Object.assign(prototype, {
    clearRect(...box) {
      texts.set(this.canvas, []);
      return clearRect.apply(this, box);
    },
    strokeText(text, x, y) { // the rim of a text, which hides what is below
      below = inked(this.canvas, boxOf(cornersOf(this, text, x, y)));
      return strokeText.call(this, text, x, y);
    },
    fillText(text, x, y) {
      const box = boxOf(cornersOf(this, text, x, y));
      if (text !== "") texts.get(this.canvas)?.push({ text, box, below });
      below = 0;
      return fillText.call(this, text, x, y);
    },
  });
  const placed = (canvas, found) => {
    const frame = canvas.getBoundingClientRect(), scale = frame.width / canvas.width;
    const chart = canvas.matches(".over") ? canvas.closest(".uplot").querySelector("canvas") : null;
    return (texts.get(canvas) ?? []).map(({ text, box, below }) => {
      const [left, right, top, bottom] = [box.left, box.right, box.top, box.bottom]
        .map((at) => scale * at);
      if (chart !== null) {
        const { left: x, top: y } = chart.getBoundingClientRect();
        const [dx, dy] = [(frame.left - x) / scale, (frame.top - y) / scale];
        below += inked(chart, { left: box.left + dx, right: box.right + dx,
          top: box.top + dy, bottom: box.bottom + dy });
        if (below > 8) found.push(`${text}: struck through, ${below} px`);
      }
      if (left < -0.5 || right > frame.width + 0.5 || top < -0.5 || bottom > frame.height + 0.5) {
        found.push(`${text}: cut`);
      }
      return { text, left: frame.left + left, right: frame.left + right,
        top: frame.top + top, bottom: frame.top + bottom };
    });
  };
  globalThis.overprinted = () => [...document.querySelectorAll("figure")].flatMap((figure) => {
    const found = [];
    const boxes = [...figure.querySelectorAll("canvas")].flatMap((one) => placed(one, found));
    boxes.forEach((a, i) => boxes.slice(0, i).forEach((b) => {
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const up = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > 0.5 && up > 0.5) found.push(`${b.text} over ${a.text}`);
    }));
    if (boxes.length < 3) found.push(`${boxes.length} texts on ${figure.id}`);
    return found;
  });
}"""


def states_of(visitor: Visitor, model: str) -> Iterator[str]:
    """Bring the page into one state after another, and name each."""
    yield "as found"
    if visitor.page.get_by_role("button", name="More").is_visible():
        visitor.press("More")
    visitor.choose(model)
    critical = 1e-3 * visitor.state("shown.fold.drive_torque")
    for part in (0.0, 0.3, 0.9, 0.99, 0.9999):
        begin_at(visitor, 1e3 * part * critical)
        yield f"{part} of the critical torque"
        visitor.press("Put a wet patch under it")
        visitor.simulate(0.31)
        yield f"{part} of the critical torque, on a wet patch"
    visitor.choose(model)
    visitor.enter(rate=100.0, torque=1.05 * critical)
    for i in range(12):
        visitor.simulate(0.2)
        yield f"slipping away, {i}"
    for reference in (0.1, 1.0, 1.5, 2.4):
        visitor.choose(model)
        visitor.check("Creep control")
        visitor.enter(reference=reference)
        for i in range(3):
            yield f"held at {reference}, {i}"
            visitor.simulate(0.5)
    visitor.check("Ellipse")
    visitor.enter(k_hat=0.9, load=100.0)
    yield "an ellipse with a long process zone"
    visitor.choose(model)
    visitor.enter(k_hat=0.0)
    yield "no fall of friction"
    visitor.enter(load=5e4)
    yield "a load of large numbers"
    visitor.choose(model)
    visitor.press("Wet patch")
    yield "an experiment"
    visitor.press("Spring")
    for i in range(3):
        visitor.simulate(0.05)
        yield f"a wheel that stands, {i}"
    visitor.choose("locomotive")
    visitor.enter(rate=1e3, torque=30.0)
    visitor.simulate(30.0)
    assert visitor.state("run.stopped") is not None
    yield "stopped"


@pytest.fixture(scope="module")
def watched() -> Iterator[Visitor]:
    """A page of its own, as its texts are watched from the beginning."""
    with explorer_page(clock_stands=True) as opened:
        opened.call(WATCH_TEXTS)
        yield Visitor(opened)
        opened.errors[:] = [e for e in opened.errors if "willReadFrequently" not in e]  # read here


def test_type_grows_with_the_screen(visitor: Visitor) -> None:
    heights = {}
    for width, height in ((1280, 800), (1440, 900), (1920, 1080), (1440, 900)):
        visitor.page.set_viewport_size({"width": width, "height": height})
        visitor.look()
        heights[width, height] = visitor.call(TYPE_SIZES)
    smallest = {size: min(sizes) for size, sizes in heights.items()}
    assert smallest[1920, 1080] >= 15.0
    ratios = np.array(heights[1920, 1080]) / heights[1440, 900]
    np.testing.assert_allclose(ratios, 20.0 / 15.0, rtol=0.05)


@pytest.mark.parametrize(
    ("size", "model"),
    [
        ((360, 740), "roller_rig"),
        ((768, 1024), "locomotive"),
        ((1280, 720), "locomotive"),
        pytest.param((1920, 1080), "locomotive", marks=pytest.mark.slow),
        pytest.param((390, 844), "locomotive", marks=pytest.mark.slow),
        pytest.param((1280, 800), "roller_rig", marks=pytest.mark.slow),
        pytest.param((1440, 900), "roller_rig", marks=pytest.mark.slow),
    ],
)
def test_nothing_overlaps_or_is_cut(watched: Visitor, size: tuple[int, int], model: str) -> None:
    watched.page.set_viewport_size({"width": size[0], "height": size[1]})
    flaws = {}
    for state in states_of(watched, model):
        watched.look()
        flaws[state] = watched.call(FLAWS) + watched.call("() => overprinted()")
    assert {at: faults for at, faults in flaws.items() if faults} == {}
    if size[0] > 1180:
        assert watched.call("() => document.documentElement.scrollHeight") <= size[1]


def test_the_theme_is_the_system_s_until_one_is_chosen() -> None:
    charts = ("creep-curve", "s-curve", "phase", "history", "patch")
    with explorer_page(clock_stands=True, color_scheme="light") as opened:
        visitor = Visitor(opened)

        def drawn() -> tuple[str, list[str]]:
            visitor.look()
            theme = visitor.call("() => document.documentElement.dataset.theme")
            return theme, [visitor.call(PIXELS, chart) for chart in charts]

        first, light = drawn()
        opened.page.emulate_media(color_scheme="dark")
        second, dark = drawn()
        opened.page.get_by_role("button", name="Switch between light and dark").click()
        third, again = drawn()
        opened.page.emulate_media(color_scheme="light")
        opened.page.emulate_media(color_scheme="dark")
        assert (first, second, third, drawn()[0]) == ("light", "dark", "light", "light")
    for chart, before, other in zip(charts, light, dark, strict=True):
        assert before != other, chart
    assert again == light
