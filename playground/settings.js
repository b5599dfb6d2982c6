"use strict";
// What a robot and the user's choices become: settings of the core. The same as host_sim/bslam/options.py.

const LEAST_BEARING_SD_RAD = 1e-4;
const LEAST_RANGE_SD_M = 1e-3;
const SIGHTING_NOISE = ["bearing_sd_rad", "range_sd_floor_m", "range_sd_fraction"];

/** Of a log: kind of odometry, whether its sightings have scores. */
function presetsOf(log, choices) {
    const sigma = log.robot.wheel_speed_sigma_mps;
    const isPaper = log.odometry.kind === "wheels" && log.robot.wheel_noise === "speedometer" && sigma > 0;
    const chosen = [isPaper ? "paper" : "real-wheels"];
    if (log.odometry.kind === "velocity" && sigma === 0) {
        chosen.push("commanded");
    }
    if (log.sightings.score) {
        chosen.push("camera");
    }
    if (choices.observation === "direction") {
        chosen.push("bearing-only");
    }
    return chosen;
}

/** Every setting by its name. choices: observation, association, filter, recovery. */
function coreSettings(estimator, log, choices) {
    const presets = presetsOf(log, choices);
    const preset = estimator.presetSettings(presets, choices.association, choices.filter);
    const settings = { ...preset, motion: 1, ...robotSettings(log.robot, log.odometry.kind) };
    settings.ahead_max_us = Math.max(settings.ahead_max_us, odometryIntervalUs(log.odometry.timeUs));
    settings.sighting_delay_us += preset.sighting_delay_us;
    if (presets.includes("commanded")) {
        for (const name of SIGHTING_NOISE) {
            settings[name] = Math.max(settings[name], preset[name]);
        }
    }
    for (const name of Object.keys(log.robot.settings || {})) {
        requireKnown(`robot.toml, [settings], key ${name}: no such setting`, name, estimator.names);
    }
    return { ...settings, ...log.robot.settings, recovery: choices.recovery ? 1 : 0 };
}

/** The usual one: no frame after the last reading is older than what odometry would have covered. */
function odometryIntervalUs(timeUs) {
    return timeUs.length > 1 ? Math.min(Math.trunc(median(differences(timeUs))), 10000000) : 0;
}

function differences(values) {
    return Array.from(values)
        .slice(1)
        .map((value, index) => value - values[index]);
}

function robotSettings(robot, kind) {
    const perM = 1 / robot.range_sigma_scale_m;
    const floorM = robot.range_sigma_floor_m ?? 0;
    const rangeErrs = floorM > 0 || robot.range_sigma_fraction > 0 || perM > 0;
    const settings = {
        wheelbase_m: robot.wheelbase_m,
        left_speed_sd_mps: robot.wheel_speed_sigma_mps,
        right_speed_sd_mps: robot.wheel_speed_sigma_mps,
        gyro_sd_radps: robot.gyro_sigma_radps ?? 0.02,
        mount_x_m: robot.sensor_x_m ?? 0,
        mount_y_m: robot.sensor_y_m ?? 0,
        mount_yaw_rad: robot.sensor_yaw_rad ?? 0,
        sighting_delay_us: robot.sighting_delay_us ?? 0,
        range_scale_sd: robot.sighting_scale_sd ?? 0,
        bearing_sd_rad: Math.max(robot.bearing_sigma_rad, LEAST_BEARING_SD_RAD),
        range_sd_floor_m: rangeErrs ? floorM : LEAST_RANGE_SD_M,
        range_sd_fraction: robot.range_sigma_fraction,
        range_sd_per_m: perM,
    };
    if (robot.sighting_correlation_m > 0) {
        settings.correlation_m = robot.sighting_correlation_m;
    }
    if (kind === "ticks") {
        for (const key of ["left_radius_m", "right_radius_m", "ticks_per_revolution", "counter_bits"]) {
            settings[key] = robot[key];
        }
    }
    return settings;
}
