"""Short descriptions of a scenario's disturbances, for headers of tables, pages and pictures."""

from uuv_marl.scenario.disturbance_sections import Fault
from uuv_marl.scenario.scenario import Scenario

IDEAL = "still water, no noise, no delay"  # conditions of a scenario without disturbances


def conditions(scenario: Scenario) -> str:
    """Active disturbances, such as ``current 0.5 m/s, sonar 0.3 s late``; ``IDEAL`` if there are none."""
    return ", ".join(disturbances(scenario)) or IDEAL


def disturbances(scenario: Scenario) -> list[str]:
    """A phrase with numbers for each active disturbance."""
    traffic = scenario.traffic
    moving = f"{traffic.share:.3g} of obstacles move at {traffic.speed_mps:g} m/s, amplitude {traffic.amplitude_m:g} m"
    return [*vehicle_disturbances(scenario), *([moving] if traffic.moves else [])]


def vehicle_disturbances(scenario: Scenario) -> list[str]:
    """Disturbances of vehicles and sonar, without moving obstacles."""
    current, navigation, actuators = scenario.current, scenario.navigation, scenario.actuators
    mismatch, sound_mps = scenario.mismatch, scenario.latency.sound_speed_mps
    differ = max(mismatch.mass, mismatch.added_mass, mismatch.drag, mismatch.thrust)
    modem, every_s = scenario.modem, scenario.modem.round_s(scenario.swarm.num_vehicles, sound_mps)
    chosen = f" of {modem.message_entries} x {modem.bits_per_entry} bits" if modem.message_entries else ""
    phrases = {
        f"current {current.speed_mps:g} m/s": current.speed_mps > 0.0,
        f"current varies by {current.variation_mps:g} m/s": current.variation_mps > 0.0,
        f"eddies of {current.eddy_speed_mps:g} m/s": current.eddies > 0 and current.eddy_speed_mps > 0.0,
        "own velocity known through the water": current.velocity == "water",
        **_of_sonar(scenario),
        f"messages{chosen} every {every_s:.3g} s, {modem.loss_probability:.3g} of them lost": modem.message_entries > 0
        or "modem" in scenario.sonar.channels,
        f"position drifts by {navigation.drift_share:.3g} of the distance": navigation.drift_share > 0.0,
        f"compass bias {navigation.compass_bias_deg:g} deg": navigation.compass_bias_deg > 0.0,
        f"thrust lags {actuators.thrust_lag_s:g} s": actuators.thrust_lag_s > 0.0,
        f"torque lags {actuators.yaw_lag_s:g} s": actuators.yaw_lag_s > 0.0,
        f"yaw authority {actuators.yaw_authority:.3g}": actuators.yaw_authority < 1.0,
        f"vehicles differ by up to {differ:.3g}": differ > 0.0,
        **{f"{_fault_phrase(fault)} on {fault.share:.3g} of vehicles": fault.share > 0.0 for fault in scenario.faults},
    }
    return [phrase for phrase, on in phrases.items() if on]


def sonar_is_ideal(scenario: Scenario) -> bool:
    """Whether sonar readings have no delay, noise or loss."""
    failing = any(fault.kind == "array" and fault.share > 0.0 for fault in scenario.faults)
    return not failing and not any(_of_sonar(scenario).values())


def _of_sonar(scenario: Scenario) -> dict[str, bool]:
    latency, noise = scenario.latency, scenario.noise
    compensated = ", compensated" if latency.compensated else ""
    return {
        f"sound at {latency.sound_speed_mps:g} m/s": latency.travel_time,
        f"sonar {latency.processing_s:g} s late{compensated}": latency.processing_s > 0.0,
        f"a ping every {latency.active_period_s:g} s": latency.active_period_s > 0.0,
        f"passive readings every {latency.passive_period_s:g} s": latency.passive_period_s > 0.0,
        f"bearing noise {noise.bearing_deg:g} deg": noise.bearing_deg > 0.0,
        f"range noise {noise.range_m:g} m + {noise.range_share:.3g}": noise.range_m > 0.0 or noise.range_share > 0.0,
        f"passive range factor, log-sd {noise.passive_range_log_sd:g}": noise.passive_range_log_sd > 0.0,
        "passive arrays measure bearings only": not noise.passive_ranges,
        f"active arrays detect half at {noise.active_r50_m:g} m": noise.active_r50_m > 0.0,
        f"passive arrays detect half at {noise.passive_r50_m:g} m": noise.passive_r50_m > 0.0,
        f"silence begins at {noise.silence_probability:.3g} of readings": noise.silence_probability > 0.0,
        f"false echoes {noise.false_echo_probability:.3g} per sub-sector": noise.false_echo_probability > 0.0,
    }


def _fault_phrase(fault: Fault) -> str:
    left = f" to {fault.efficiency:.3g}" if fault.efficiency > 0.0 else ""
    return f"{fault.kind if fault.array is None else f'{fault.array} array'} fault{left}"
