//! The rule of the verdict.

use serde::Serialize;

/// Lack of fit from which on something is left, in standard deviations of white rows: coloured noise is never quite white, and
/// sessions with nothing hidden reach 4.8.
pub const LACK_OF_FIT: f64 = 6.0;
/// Share of the calibrated model's lack of fit that may be left where effects were named: the shape of a law is never exact.
pub const NEGLIGIBLE: f64 = 0.05;
/// Ratio of the residual variance to that of repeats from which on no share is negligible: what is left is then larger than the noise.
pub const NEAR_NOISE: f64 = 2.0;

/// What a search came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The named effects explain what the model lacked.
    Explained,
    /// The model explains the data as it is.
    NothingMissing,
    /// Something is left that no effect of the catalogue explains.
    Unexplained,
}

/// What a verdict rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Whether an effect was named.
    pub named: bool,
    /// Whether a channel of the test trials is open.
    pub is_open: bool,
    /// Lack of fit on the fit trials in standard deviations; not a number without repeats.
    pub z: f64,
    /// Lack of fit on the fit trials as a ratio of variances: of the residual, and of repeats.
    pub ratio: f64,
    /// Share of the calibrated model's lack of fit that is left.
    pub share: f64,
}

impl Verdict {
    /// All verdicts.
    pub const ALL: [Self; 3] = [Self::Explained, Self::NothingMissing, Self::Unexplained];

    /// The verdict rule: `unexplained` where a channel is open on the test trials, or where the lack of fit is at least [`LACK_OF_FIT`] and not
    /// negligible; else `explained` where an effect was named. Without repeats the test trials alone decide.
    pub fn of(evidence: &Evidence) -> Self {
        let Evidence {
            named,
            is_open,
            z,
            ratio,
            share,
        } = *evidence;
        let negligible = named && share < NEGLIGIBLE && ratio < NEAR_NOISE;
        if is_open || (z >= LACK_OF_FIT && !negligible) {
            Self::Unexplained
        } else if named {
            Self::Explained
        } else {
            Self::NothingMissing
        }
    }

    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::NothingMissing => "nothing_missing",
            Self::Unexplained => "unexplained",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEAR: Evidence = Evidence {
        named: true,
        is_open: false,
        z: 0.0,
        ratio: 1.0,
        share: 0.0,
    };

    /// Both sides of each limit.
    #[test]
    fn each_limit_decides_at_its_value() {
        let of = Verdict::of;
        assert_eq!(of(&CLEAR), Verdict::Explained);
        let unnamed = Evidence {
            named: false,
            ..CLEAR
        };
        assert_eq!(of(&unnamed), Verdict::NothingMissing);
        for named in [true, false] {
            let open = Evidence {
                is_open: true,
                named,
                ..CLEAR
            };
            assert_eq!(of(&open), Verdict::Unexplained);
        }
        let large = Evidence {
            z: 6.0,
            ratio: 2.0,
            share: 0.05,
            ..CLEAR
        };
        assert_eq!(of(&large), Verdict::Unexplained);
        let below = Evidence { z: 5.99, ..large };
        assert_eq!(of(&below), Verdict::Explained);
        let small = Evidence {
            ratio: 1.99,
            share: 0.049,
            ..large
        };
        assert_eq!(of(&small), Verdict::Explained);
        for change in [
            Evidence {
                ratio: 2.0,
                ..small
            },
            Evidence {
                share: 0.05,
                ..small
            },
            Evidence {
                named: false,
                ..small
            },
        ] {
            assert_eq!(of(&change), Verdict::Unexplained);
        }
        let unrepeated = Evidence {
            z: f64::NAN,
            ..large
        };
        assert_eq!(of(&unrepeated), Verdict::Explained);
    }

    #[test]
    fn names_are_those_of_the_json() {
        let names = Verdict::ALL.map(Verdict::name);
        assert_eq!(names, ["explained", "nothing_missing", "unexplained"]);
    }
}
