//! The safety monitor: every fault is seen within two control periods, and nothing else is.

use arm_core::monitor::{Monitor, MonitoredChannel, Observation, Quantity, Reason, Stop, Times};
use arm_core::{Invalid, Joints, Limits, Path, Real, Shape};

use crate::common::Random;

/// One control period \[µs\].
const PERIOD: u64 = 1_000;
/// Data may be one period old.
const OLDEST: u64 = PERIOD;
/// How long a channel may stand still under a command to move \[µs\].
const FROZEN: u64 = 20_000;

/// Angle, speed, acceleration, force and power of one joint.
fn channels<T: Real>() -> [MonitoredChannel<T>; 5] {
    let of = T::of;
    [
        MonitoredChannel::range(Quantity::Angle, of(-1.5), of(1.5)).frozen_after(FROZEN),
        MonitoredChannel::magnitude(Quantity::Speed, of(2.0)),
        MonitoredChannel::magnitude(Quantity::Acceleration, of(10.0)),
        MonitoredChannel::magnitude(Quantity::Force, of(110.0)).frozen_after(FROZEN),
        MonitoredChannel::magnitude(Quantity::Power, of(60.0)),
    ]
}

fn monitor<T: Real>() -> Monitor<T, 5> {
    Monitor::new(
        channels(),
        Times {
            oldest: OLDEST,
            period: 2 * PERIOD,
        },
    )
    .expect("the limits are in order")
}

/// Period `k` of a clean run: up and down within all limits, with a little noise so that no value repeats.
fn clean<T: Real>(path: &Path<f64, 1>, k: u64, random: &mut Random) -> Observation<T, 5> {
    let motion = path.at(k as f64 * 1e-3);
    let mut noisy = |value: f64, size: f64| T::of(value + size * random.uniform(-1.0, 1.0));
    let force = 20.0 * motion.qd[0];
    Observation {
        now: 7_000 + k * PERIOD,
        stamp: 7_000 + k * PERIOD,
        values: [
            noisy(motion.q[0], 1e-4),
            noisy(motion.qd[0], 1e-3),
            noisy(motion.qdd[0], 1e-2),
            noisy(force, 0.1),
            noisy(force * motion.qd[0], 0.1),
        ],
        moving: [motion.qd[0] != 0.0; 5],
    }
}

fn with_path<R>(run: impl FnOnce(&Path<f64, 1>) -> R) -> R {
    let waypoints = [-1.0, 1.0, -1.0].map(|q| Joints::from([q]));
    let limits = Limits {
        speed: 1.0,
        acceleration: 4.0,
    };
    run(&Path::new(Shape::Smooth, &waypoints, [limits], 0.5).expect("a path within its limits"))
}

/// A fault put into a clean run from period `from` on; returns the stop and the periods until it.
fn caught<T: Real>(
    from: u64,
    fault: impl Fn(&mut Observation<T, 5>, &Observation<T, 5>, u64),
) -> Option<(u64, Stop<T>)> {
    with_path(|path| {
        let (mut monitor, mut random) = (monitor::<T>(), Random(5));
        let mut held = clean(path, 0, &mut random);
        for k in 0..4_000 {
            let mut seen = clean(path, k, &mut random);
            if k < from {
                held = seen;
            } else {
                fault(&mut seen, &held, k - from);
            }
            if let Err(stop) = monitor.check(&seen) {
                assert!(k >= from, "stopped before the fault: {stop:?}");
                return Some((k - from + 1, stop));
            }
        }
        None
    })
}

fn clean_runs_pass<T: Real>() {
    with_path(|path| {
        for seed in 0..100 {
            let (mut monitor, mut random) = (monitor::<T>(), Random(seed));
            for k in 0..6_000 {
                assert_eq!(
                    monitor.check(&clean(path, k, &mut random)),
                    Ok(()),
                    "seed {seed}, period {k}"
                );
            }
        }
    });
}

#[test]
fn it_never_stops_a_clean_run() {
    clean_runs_pass::<f64>();
    clean_runs_pass::<f32>();
}

#[test]
fn a_sample_that_is_used_twice_is_not_frozen() {
    // A sensor at half the rate of the controller, one period late: allowed.
    with_path(|path| {
        let (mut monitor, mut random) = (monitor::<f64>(), Random(3));
        let mut seen = clean(path, 0, &mut random);
        for k in 0..6_000 {
            let fresh = clean(path, k, &mut random);
            if k % 2 == 0 {
                seen = fresh;
            }
            seen.now = fresh.now;
            assert_eq!(monitor.check(&seen), Ok(()), "period {k}");
        }
    });
}

fn limits_stop_at_once<T: Real>() {
    for channel in 0..5 {
        for sign in [-1.0, 1.0] {
            let limit = channels::<T>()[channel].max;
            let value = T::of(sign * 1.01) * limit;
            let (periods, stop) =
                caught::<T>(2_000, |seen, _, _| seen.values[channel] = value).expect("a stop");
            assert_eq!(periods, 1);
            let found = (stop.reason, stop.channel, stop.value, stop.limit);
            assert_eq!(
                found,
                (Reason::Limit, Some(channel), value, T::of(sign) * limit)
            );
            assert_eq!(stop.at, 7_000 + 2_000 * PERIOD);
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (periods, stop) =
                caught::<T>(2_000, |seen, _, _| seen.values[channel] = T::of(bad)).expect("a stop");
            assert_eq!(
                (periods, stop.reason, stop.channel),
                (1, Reason::NotFinite, Some(channel))
            );
        }
    }
}

#[test]
fn a_value_beyond_its_limit_stops_in_the_same_period() {
    limits_stop_at_once::<f64>();
    limits_stop_at_once::<f32>();
}

#[test]
fn data_that_stop_coming_stop_the_device_within_two_periods() {
    let (periods, stop) = caught::<f64>(2_000, |seen, held, _| {
        seen.stamp = held.stamp;
        seen.values = held.values;
    })
    .expect("a stop");
    assert_eq!(
        (periods, stop.reason, stop.channel),
        (2, Reason::Late, None)
    );
    assert!((stop.value - 2e-3).abs() < 1e-12 && stop.limit == 1e-3);
}

#[test]
fn a_frozen_value_stops_the_device_two_periods_after_its_time() {
    for channel in [0, 3] {
        let (periods, stop) = caught::<f32>(500, |seen, held, _| {
            seen.values[channel] = held.values[channel];
        })
        .expect("a stop");
        assert_eq!((stop.reason, stop.channel), (Reason::Frozen, Some(channel)));
        assert!(
            periods * PERIOD <= FROZEN + 2 * PERIOD,
            "after {periods} periods"
        );
        assert!(stop.value > stop.limit);
    }
    // A channel without a freezing time may rest.
    let rested = caught::<f64>(500, |seen, held, _| seen.values[2] = held.values[2]);
    assert!(rested.is_none(), "{rested:?}");
}

#[test]
fn a_resting_arm_may_show_the_same_bits() {
    let mut monitor = monitor::<f64>();
    for k in 0..10_000 {
        let seen = Observation {
            now: k * PERIOD,
            stamp: k * PERIOD,
            values: [0.25, 0.0, 0.0, 3.0, 0.0],
            moving: [false; 5],
        };
        assert_eq!(monitor.check(&seen), Ok(()));
    }
    // Time at rest does not count once it is to move.
    let mut seen = Observation {
        now: 10_000 * PERIOD,
        stamp: 10_000 * PERIOD,
        values: [0.25, 0.0, 0.0, 3.0, 0.0],
        moving: [true; 5],
    };
    for _ in 0..FROZEN / PERIOD {
        assert_eq!(monitor.check(&seen), Ok(()));
        seen.now += PERIOD;
        seen.stamp += PERIOD;
    }
}

#[test]
fn clocks_that_run_backwards_stop_the_device() {
    let (_, stop) = caught::<f64>(2_000, |seen, _, _| seen.stamp -= 2 * PERIOD).expect("a stop");
    assert_eq!(stop.reason, Reason::Clock);
    let (_, stop) = caught::<f64>(2_000, |seen, _, _| seen.stamp = seen.now + 1).expect("a stop");
    assert_eq!(stop.reason, Reason::Clock);
    let (_, stop) = caught::<f64>(2_000, |seen, _, _| {
        seen.now -= 5 * PERIOD;
        seen.stamp -= 5 * PERIOD;
    })
    .expect("a stop");
    assert_eq!(stop.reason, Reason::Clock);
}

#[test]
fn the_first_stop_is_kept_until_reset() {
    let mut monitor = monitor::<f64>();
    let mut seen = Observation {
        now: PERIOD,
        stamp: PERIOD,
        values: [2.0, 0.0, 0.0, 0.0, 0.0],
        moving: [false; 5],
    };
    let first = monitor.check(&seen).expect_err("an angle too large");
    seen.values = [0.0, f64::NAN, 0.0, 500.0, 0.0];
    assert_eq!(monitor.check(&seen), Err(first));
    seen.values = [0.0; 5];
    assert_eq!(monitor.check(&seen), Err(first), "a stop latches");
    assert_eq!(monitor.stop(), Some(&first));
    monitor.reset();
    // Even a clock that was set back is new.
    seen.now = 0;
    seen.stamp = 0;
    assert_eq!(monitor.check(&seen), Ok(()));
    assert_eq!(monitor.stop(), None);
}

#[test]
fn a_loop_that_stalls_stops_the_device() {
    let (periods, stop) = caught::<f64>(2_000, |seen, _, _| {
        seen.now += 3 * PERIOD;
        seen.stamp += 3 * PERIOD;
    })
    .expect("a stop");
    assert_eq!(
        (periods, stop.reason, stop.channel),
        (1, Reason::Stalled, None)
    );
    assert!((stop.value - 4e-3).abs() < 1e-12 && stop.limit == 2e-3);
}

#[test]
fn a_value_that_changes_too_fast_or_too_far_stops_the_device() {
    let check = |channel: MonitoredChannel<f64>, second: (u64, f64)| {
        let times = Times {
            oldest: PERIOD,
            period: 10 * PERIOD,
        };
        let mut monitor = Monitor::new([channel], times).expect("limits");
        let mut seen = Observation {
            now: PERIOD,
            stamp: PERIOD,
            values: [0.0],
            moving: [true],
        };
        assert_eq!(monitor.check(&seen), Ok(()));
        (seen.now, seen.stamp, seen.values[0]) = (PERIOD + second.0, PERIOD + second.0, second.1);
        monitor
            .check(&seen)
            .map_err(|stop| (stop.reason, stop.value, stop.limit))
    };
    let open = MonitoredChannel::magnitude(Quantity::Angle, 10.0);
    assert_eq!(check(open, (PERIOD, 9.0)), Ok(()));
    let slow = open.fastest(100.0);
    assert_eq!(check(slow, (PERIOD, 0.09)), Ok(()));
    assert_eq!(check(slow, (5 * PERIOD, 0.45)), Ok(()));
    let (reason, value, limit) = check(slow, (PERIOD, 0.2)).expect_err("200 rad/s");
    assert!((value - 200.0).abs() < 1e-9);
    assert_eq!((reason, limit), (Reason::Jump, 100.0));
    let near = open.farthest(0.5);
    assert_eq!(check(near, (5 * PERIOD, 0.5)), Ok(()));
    assert_eq!(
        check(near, (5 * PERIOD, -0.6)),
        Err((Reason::Jump, 0.6, 0.5))
    );
    // A new value under an old time stamp has changed in no time.
    assert!(check(slow, (0, 0.01)).is_err());
}

#[test]
fn a_monitor_without_channels_or_period_is_refused() {
    let times = |period| Times { oldest: 0, period };
    assert!(Monitor::<f64, 0>::new([], times(1)).is_err());
    let channel = MonitoredChannel::magnitude(Quantity::Angle, 1.0);
    assert!(Monitor::new([channel], times(0)).is_err());
    assert!(Monitor::new([channel.fastest(0.0)], times(1)).is_err());
    assert!(Monitor::new([channel.farthest(f64::NAN)], times(1)).is_err());
}

#[test]
fn impossible_limits_are_refused() {
    let refused = |min, max| {
        let times = Times {
            oldest: 0,
            period: 1,
        };
        Monitor::<f64, 1>::new([MonitoredChannel::range(Quantity::Angle, min, max)], times)
            .map(|_| ())
    };
    assert_eq!(refused(f64::NEG_INFINITY, f64::INFINITY), Ok(()));
    let nan = Err(Invalid::NotFinite {
        name: "limit of channel",
        index: 0,
    });
    assert_eq!(refused(f64::NAN, 1.0), nan);
    assert_eq!(refused(0.0, f64::NAN), nan);
    let found = refused(1.0, -1.0).expect_err("an empty range");
    assert!(matches!(found, Invalid::OutOfRange { found, min, .. } if (found, min) == (-1.0, 1.0)));
}
