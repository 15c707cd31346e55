//! Location of the time at which a margin becomes negative.

/// Trials by regula falsi; then by halves, which locate everything in 40 more.
const BY_VALUES: usize = 20;
/// Trials of both kinds.
const TRIALS: usize = 60;
/// How near a switch is located, as a fraction of the step.
pub(super) const LOCATED: f64 = 1e-12;

/// The place where a margin is zero, or just beyond it, by regula falsi in its Illinois form.
///
/// * `low`, `high` - places with the margins there, the first above zero and the second below
pub(super) fn first_beyond(
    [mut low, mut high]: [(f64, f64); 2],
    mut margin_at: impl FnMut(f64) -> f64,
) -> f64 {
    let mut was_beyond = None;
    for trial in 1..=TRIALS {
        if high.0 - low.0 < LOCATED {
            break;
        }
        let share = if trial > BY_VALUES {
            0.5
        } else {
            low.1 / (low.1 - high.1)
        };
        let [first, last] = [low.0 + 0.5 * LOCATED, high.0 - 0.5 * LOCATED];
        let tried = (low.0 + share * (high.0 - low.0)).max(first).min(last);
        let margin = margin_at(tried);
        let beyond = margin <= 0.0;
        // The value at an end that stays for a second time counts half, or that end would stay for good.
        let stays = if was_beyond == Some(beyond) { 0.5 } else { 1.0 };
        if beyond {
            high = (tried, margin);
            low.1 *= stays;
            if margin > -LOCATED {
                break;
            }
        } else {
            low = (tried, margin);
            high.1 *= stays;
        }
        was_beyond = Some(beyond);
    }
    high.0
}

#[cfg(test)]
mod tests {
    use super::*;

    type Margin = fn(f64) -> f64;

    /// With values that counted half at every trial, the first four took 39, 40, 25 and 60.
    #[test]
    fn a_switch_is_located_in_few_trials() {
        let margins: [(Margin, f64, usize); 5] = [
            (|x| 0.216 - x * x * x, 0.6, 12),
            (|x| 1.0 - (x + 0.5) * (x + 0.5), 0.5, 10),
            (|x| (0.1 - x) * (2.0 - x) * 1e-4, 0.1, 10),
            // It ends in a stretch where it is zero, as the margin of a speed that is rounding.
            (
                |x| {
                    if x < 0.7 {
                        0.7 - x * x / 0.7
                    } else {
                        (0.7 + 1e-9 - x).min(0.0)
                    }
                },
                0.7,
                10,
            ),
            (|x| if x < 0.6 { 1.0 } else { -1e-3 }, 0.6, 60),
        ];
        for (margin, place, most) in margins {
            let mut trials = 0;
            let found = first_beyond([(0.0, margin(0.0)), (1.0, margin(1.0))], |x| {
                trials += 1;
                margin(x)
            });
            assert!((found - place).abs() < 2e-9, "{found}");
            assert!(margin(found) <= 0.0);
            assert!(trials <= most, "{trials} trials for {place}");
        }
    }
}
