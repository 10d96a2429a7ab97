"""The plant as Gymnasium environments: one wheelset or vehicle, or many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from contactlib.base.lazy import optional_library
from contactlib.base.quantities import (
    NOT_NEGATIVE,
    POSITIVE,
    FloatArray,
    Limits,
    checked_number,
    checked_whole,
    warn,
)
from contactlib.files.scenario import Scenario, load_scenario
from contactlib.runs.accumulators import NEGLIGIBLE, DerivedRows, DrivetrainArrays
from contactlib.runs.plant import Plant, default_step
from contactlib.runs.scenario_runs import DEFAULT_TOLERANCE, LONGEST_STEP
from contactlib.runs.signals import SHARED
from contactlib.traction import Measurement
from contactlib.traction.interface import FASTEST, STRONGEST, plausible

if TYPE_CHECKING:
    import gymnasium
else:
    gymnasium = optional_library("gymnasium")

LOW_SPEED = 1.0  # vehicle speed below which slip costs as at this one [m/s]
COUNT = Limits(at_least=1.0, at_most=1e6)
DRAWN = 2**31  # indices of runs that are drawn without a seed
TRUTH = (  # signals in an environment's info
    "speed",
    "creepage",
    "creep_force",
    "available_force",
    "commanded_torque",
    "falling_branch",
)
Info = dict[str, Any]


class Scales(NamedTuple):
    """What the numbers of an observation are divided by.

    Attributes
    ----------
    torque : float
        Scale of demand and commanded torque [N.m].
    speed, slip_speed : float
        Scale of the vehicle speed, and of measured wheel speed - vehicle speed [m/s].
    """

    torque: float
    speed: float = 10.0
    slip_speed: float = 0.1


class _Vehicles:
    """Vehicles of an environment as arrays of shape (n,), or (n, axles) of several axles.

    It is a plant with observation and reward.

    Copies, shallow ones too, and pickles are independent and go on with the same bits.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        *,
        sample_time: float = 0.01,
        step: float | None = None,
        tolerance: float = DEFAULT_TOLERANCE,
        scales: Scales | None = None,
        slip_cost: float = 1.0,
    ) -> None:
        distinct = {id(one): one for one in scenarios}.values()
        if step is None:
            step = min(default_step(one, LONGEST_STEP) for one in distinct)
        for one in scenarios:
            if one.drivetrain.sanding and one.drivetrain.sanding.by == "controller":
                raise ValueError(
                    "scenario.drivetrain.sanding.by = 'controller': an action is a torque alone; "
                    "set by = 'speed'"
                )
        self.plant = Plant(scenarios, sample_time=sample_time, step=step, tolerance=tolerance)
        self.scenarios, self.sample_time = scenarios, float(sample_time)
        durations = sorted({one.duration for one in distinct})
        if len(durations) > 1:
            raise ValueError(f"scenarios have durations of {durations} s: they must be equal")
        self._end = durations[0] * (1.0 - 1e-9)
        if scales is None:
            largest = max(abs(x) for one in distinct for x in one.demand.value)
            scales = Scales(largest or 1.0)
        self.scales = Scales(
            *(checked_number(f"scales.{k}", v, POSITIVE) for k, v in scales._asdict().items())
        )
        self._slip_cost = checked_number("slip_cost", slip_cost, NOT_NEGATIVE)
        self.axles = self.plant.axles
        self._drivetrains = DrivetrainArrays.of(self.plant.trains, self.axles)
        self._doubted = False
        self._divisors = np.array([self.scales.torque, *self.scales])
        highest = np.array([STRONGEST, STRONGEST, FASTEST, 2.0 * FASTEST]) / self._divisors
        # Rounding to 32 bits does not exceed these bounds.
        bound = np.nextafter(highest.astype(np.float32), np.float32(np.inf))
        if self.axles > 1:
            bound = np.tile(bound, (self.axles, 1))
        self._observations = gymnasium.spaces.Box(-bound, bound, dtype=np.float32)
        self._actions = gymnasium.spaces.Box(0.0, 1.0, (self.axles,), np.float32)
        self._measured: Measurement[FloatArray] | None = None

    def __copy__(self) -> Self:
        """A deep copy, as a shallow one would step the same vehicles."""
        return deepcopy(self)

    @property
    def time(self) -> float:
        """Time of the present sample [s]."""
        return self.plant.time

    @property
    def measurement(self) -> Measurement[FloatArray]:
        """The present measurement, as `Plant.step` returns it: arrays of shape (n,) or (n, axles).

        Raises
        ------
        gymnasium.error.ResetNeeded
            If no episode has begun.
        """
        if self._measured is None:
            raise gymnasium.error.ResetNeeded("call reset first: it begins an episode")
        return self._measured

    def _begin(
        self, generator: np.random.Generator, seed: int | None
    ) -> tuple[NDArray[np.float32], Info]:
        """Begin again with the run of the index `seed`, by default a random one, and the next."""
        index = int(generator.integers(DRAWN)) if seed is None else seed
        self._measured = self.plant.reset(index)
        rows = DerivedRows(self.plant.now(), self._drivetrains)
        self._work, self._start = rows["creep_work"][0], rows["distance"][0]
        return self._observed(), self._info(rows)

    def _torque(self, action: Any) -> FloatArray:
        """Torques of an action, shares of the demand from 0 to 1 [N.m].

        Raises
        ------
        ValueError
            If it has neither the shape (n, axles) nor that of the demand.
        """
        share, demand = np.asarray(action, dtype=np.float64), self.measurement.demand
        shape = len(self.scenarios), self.axles
        if share.shape not in (shape, demand.shape):
            raise ValueError(f"action has the shape {share.shape}: must be {shape}")
        share = share.reshape(demand.shape)
        return np.minimum(np.maximum(share, 0.0), 1.0) * demand

    def _held(
        self, torque: Any
    ) -> tuple[NDArray[np.float32], FloatArray, NDArray[np.bool_], bool, Info]:
        """Hold a torque until the next sample [N.m]: what `step` of an environment returns."""
        _ = self.measurement  # an episode has begun
        self._measured = self.plant.step(torque)
        rows, v = DerivedRows(self.plant.now(), self._drivetrains), self._drivetrains
        used, possible = (signal[0] for signal in rows.transmittable)
        allowed = np.maximum(rows["available_force"][0], NEGLIGIBLE * v.grip)
        way = self.sample_time * np.maximum(np.abs(rows["speed"][0]), LOW_SPEED)
        work, self._work = self._work, rows["creep_work"][0]
        lost = np.maximum(possible - used, 0.0) + self._slip_cost / way * (self._work - work)
        reward = np.where(self.plant.failed, 0.0, 1.0 - v.total(lost) / v.total(allowed))
        over = self.plant.time > self._end
        if over and not self._doubted:
            self._warn_off_map(rows["distance"][0])
        return self._observed(), reward, self.plant.failed.copy(), over, self._info(rows)

    def _warn_off_map(self, distance: FloatArray) -> None:
        """Warn once of the first axle that left the map of its track or never met it."""
        ends = np.sort([self._start, distance], axis=0).T.tolist()
        for track, (low, high) in zip(self.plant.tracks, ends, strict=True):
            if warning := track.warning(low, high):
                self._doubted = True
                warn(warning)
                return

    def _observed(self) -> NDArray[np.float32]:
        seen = plausible(self.measurement)
        slip = seen.wheel_speed - seen.vehicle_speed
        rows = np.stack([seen.demand, seen.torque, seen.vehicle_speed, slip], axis=-1)
        return np.asarray(rows / self._divisors, dtype=np.float32)

    def _info(self, rows: DerivedRows) -> Info:
        return {name: self.plant.shaped(rows[name][0], shared=name in SHARED) for name in TRUTH}


def _loaded(scenario: Scenario | str) -> Scenario:
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)


class TractionEnv(_Vehicles, gymnasium.Env[Any, Any]):
    """The wheelset or vehicle of a scenario as a Gymnasium environment.

    The observation is (demand, commanded torque, vehicle speed, slip speed) as the sensors measure
    them, over `scales`; the action the torque / demand, 0 to 1, of the shape (1,). A vehicle of
    several axles has an observation in each row and an action for each axle: shapes (axles, 4) and
    (axles,); in its reward lack, work and available force are sums. The reward of a step is

        1 - lack of force / available force - slip_cost * slip work / work of the available force

    from the state at its end and the slip work within it, which is at most 1. The available force
    counts as at least a hundredth of the grip, the vehicle speed as at least 1 m/s. The lack of
    force is what is missing of the one that could be transmitted (`contactlib.runs.Metrics`): while
    friction limits the force, the mean of the first two terms is the limited utilisation.

    The episode terminates if the integrator gives up, and is truncated at the
    scenario's duration. The info contains the truth, in the signals of `run_scenario`: "speed",
    "creepage", "creep_force", "available_force", "commanded_torque" and "falling_branch"; but for
    the speed, an array of the axles of a vehicle.

    `reset(seed=7)` draws the sensors' noise of `run_scenario(scenario, ..., index=7)`; with the
    same torques, `step` and `tolerance` the run is the same to the last bit. Without a seed the
    index is random. `copy.deepcopy`, `copy.copy` and `pickle` of an environment or its `unwrapped`
    give independent ones that continue with the same bits. (`copy.copy` of a wrapper of Gymnasium
    copies the wrapper alone.)

    ``gymnasium.make("contactlib/Traction-v1", scenario="dry_wet_dry.toml")`` makes one too, after
    ``import contactlib.rl``.

    Parameters
    ----------
    scenario : Scenario or str
        The scenario, or the name of its file.
    sample_time : float, optional
        Time from one step of the environment to the next [s].
    step : float, optional
        Longest time between rows [s]. Default: 10 ms or less, as for `run_many`; `run_scenario`
        has 5 ms.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1]; `run_scenario` has 1e-7.
    scales : Scales, optional
        Scales of the observation. Default: the scenario's largest demand, 10 m/s, and 0.1 m/s for
        the slip speed. A policy for other scenarios needs those with which it learned.
    slip_cost : float, optional
        Weight of the slip work in the reward [1].

    Attributes
    ----------
    scales : Scales
        Scales of the observation.

    Raises
    ------
    ValueError
        If a value is out of range, or no steady state holds the first demand.

    Examples
    --------
    >>> from contactlib.rl import TractionEnv
    >>> env = TractionEnv("dry_wet_dry.toml")
    >>> observation, info = env.reset(seed=7)
    >>> total, truncated = 0.0, False
    >>> while not truncated:
    ...     demand, torque, speed, slip = observation
    ...     action = [1.0 if slip < 2.0 else 0.1]
    ...     observation, reward, terminated, truncated, info = env.step(action)
    ...     total += reward
    >>> f"mean reward {total / 2000:.2f}, {info['speed']:.1f} m/s at the end"
    'mean reward 0.86, 14.2 m/s at the end'
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}  # type: ignore[misc]

    def __init__(self, scenario: Scenario | str, **settings: Any) -> None:
        super().__init__([_loaded(scenario)], **settings)
        self.observation_space, self.action_space = self._observations, self._actions

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Begin an episode; the seed is the index of its noise."""
        super().reset(seed=seed)
        observed, info = self._begin(self.np_random, seed)
        return observed[0], _alone(info)

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, Info]:
        """Hold a share of the demand until the next sample [1]."""
        return self.hold(self._torque(np.asarray(action)[np.newaxis]))

    def hold(self, torque: Any) -> tuple[NDArray[np.float32], float, bool, bool, Info]:
        """As `step`, with a torque [N.m], also one for each axle: shares round."""
        torque = np.asarray(torque)
        if torque.shape == (self.axles,):
            torque = torque.reshape(self.measurement.demand.shape)
        observed, reward, failed, over, info = self._held(torque)
        return observed[0], float(reward[0]), bool(failed[0]), over, _alone(info)


def _alone(info: Info) -> Info:
    return {name: float(v[0]) if v.ndim == 1 else v[0] for name, v in info.items()}


class TractionVectorEnv(_Vehicles, gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many wheelsets or vehicles, stepped side by side in C, as a Gymnasium vector environment.

    Observation, action, reward and info are those of `TractionEnv`, with a row for each of them;
    number i of `reset(seed=7)` is that of a `TractionEnv` with the seed 7 + i, to the last bit.

    All episodes begin and end together, as the scenarios have one duration; if an integrator gives
    up, which terminates that episode, the others are truncated. The autoreset mode is NEXT_STEP:
    the step after the last one ignores the actions, resets all and returns zero rewards.

    Parameters
    ----------
    scenario : Scenario, str or sequence of them
        Scenarios or names of their files. Environment i gets number i modulo their count: draw as
        many as you need for domain randomisation. Their durations, sensor delays and numbers of
        axles are equal.
    num_envs : int
        Number of wheelsets or vehicles.
    sample_time, step, tolerance, scales, slip_cost
        As for `TractionEnv`.

    Attributes
    ----------
    scales : Scales
        Scales of the observation.

    Raises
    ------
    ValueError
        If a value is out of range, scenarios do not fit together, or no steady state holds a first
        demand.

    Examples
    --------
    >>> import numpy as np
    >>> from contactlib.rl import TractionVectorEnv
    >>> envs = TractionVectorEnv("dry_wet_dry.toml", 64)
    >>> observations, _ = envs.reset(seed=0)
    >>> for _ in range(600):
    ...     actions = np.where(observations[:, 3:] < 2.0, 1.0, 0.1)
    ...     observations, rewards, terminated, truncated, info = envs.step(actions)
    >>> f"creepage {info['creepage'].min():.3f} to {info['creepage'].max():.3f} after 6 s"
    'creepage 0.024 to 0.066 after 6 s'
    """

    def __init__(
        self, scenario: Scenario | str | Sequence[Scenario | str], num_envs: int, **settings: Any
    ) -> None:
        self.num_envs = checked_whole("num_envs", num_envs, COUNT)
        several = [scenario] if isinstance(scenario, (Scenario, str)) else list(scenario)
        if not several:
            raise ValueError("scenario = [] is too short: an environment has at least one")
        given = [_loaded(one) for one in several]
        super().__init__([given[i % len(given)] for i in range(self.num_envs)], **settings)
        self.metadata = {
            "render_modes": [],
            "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
        }
        batch = gymnasium.vector.utils.batch_space
        self.single_observation_space = self._observations
        self.single_action_space = self._actions
        self.observation_space = batch(self.single_observation_space, self.num_envs)
        self.action_space = batch(self.single_action_space, self.num_envs)
        self._over = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Begin the episodes; the seed is the index of the first one's noise.

        Raises
        ------
        ValueError
            If ``options["reset_mask"]`` leaves one out.
        """
        mask = (options or {}).get("reset_mask", True)
        if not np.all(mask):
            raise ValueError(
                f"options['reset_mask'] = {np.asarray(mask).tolist()} leaves one out: all "
                "share one clock, so reset them together, without a mask; in Gymnasium's "
                "SyncVectorEnv each TractionEnv has its own"
            )
        super().reset(seed=seed)
        self._over = False
        return self._begin(self.np_random, seed)

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], FloatArray, NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Hold shares of the demand until the next sample [1], shape (n, axles)."""
        return self.hold(self._torque(actions))

    def hold(
        self, torque: Any
    ) -> tuple[NDArray[np.float32], FloatArray, NDArray[np.bool_], NDArray[np.bool_], Info]:
        """As `step`, with torques [N.m]: one for all, n, or (n, axles)."""
        none = np.zeros(self.num_envs, dtype=np.bool_)
        if self._over:
            observed, info = self.reset()
            return observed, np.zeros(self.num_envs), none, none.copy(), info
        observed, reward, failed, over, info = self._held(torque)
        self._over = over or bool(failed.any())
        return observed, reward, failed, ~failed if self._over else none, info


gymnasium.register(
    "contactlib/Traction-v1",
    entry_point="contactlib.rl:TractionEnv",
    vector_entry_point="contactlib.rl:TractionVectorEnv",
    kwargs={"scenario": "dry_wet_dry.toml"},
)
