//! The verdict's test on the test trials: compares the residual of each channel with the scatter between repeats.

/// What a model leaves of one trial.
#[derive(Clone, Debug)]
pub struct TrialResidual {
    /// The movement; repeats share it.
    pub group: usize,
    /// Whether it is a test trial.
    pub test: bool,
    /// Sampling rate \[Hz\].
    pub rate: f64,
    /// Measured less simulated channels; `None` where the trial cannot be simulated.
    pub residuals: Option<Vec<Vec<f64>>>,
    /// Samples that count, `[channel][sample]`.
    pub counted: Vec<Vec<bool>>,
}

/// The gap of one channel on the test trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutGap {
    /// Root mean square of what is left; `None` where no test trial can be simulated.
    pub size: Option<f64>,
    /// What repeats of one movement differ by; `None` without repeats.
    pub floor: Option<f64>,
    /// Standard deviation of the difference of both where nothing is missing.
    pub floor_std: Option<f64>,
    /// Where more is left.
    pub open: Option<OpenSpan>,
}

/// Where a channel's gap is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenSpan {
    /// The trial.
    pub trial: usize,
    /// Start and end there \[s\].
    pub span: (f64, f64),
    /// Root mean square of what is left there.
    pub size: f64,
}

/// Length of the pieces whose mean squares are taken as independent \[s\].
const PIECE: f64 = 1.0;
/// Share by which a gap may exceed its floor whatever that is uncertain by: what the robot does between its samples, and numbers that are
/// estimates.
const TOLERATED_EXCESS: f64 = 0.1;
/// Standard normal quantile of the test's level, 0.001 for each channel.
const LEVEL: f64 = 3.09;
/// Ratio to its floor above which a gap counts as clear,
pub const OPEN_GAP: f64 = 1.5;
/// and standard deviations of the floor that it must exceed it by: the table shows no more.
const UNCERTAIN: f64 = 1.0;

/// A piece of a trial: its mean square, and when it starts and ends \[s\].
#[derive(Clone, Copy)]
struct Piece {
    square: f64,
    count: usize,
    span: (f64, f64),
}

/// The gap of every channel on the test trials.
///
/// The mean square left on the test trials is compared with that of the deviations of these trials from the mean of their repeats (of other
/// movements where no test trial has a repeat). Both are means over pieces of a second; the scatter of the pieces gives the degrees of
/// freedom of each (Satterthwaite 1946). A gap is open where their ratio, less what is tolerated, exceeds the 0.999 quantile of Fisher's
/// distribution (cube-root approximation of Wilson and Hilferty 1931, Paulson 1942). Few pieces decide little at that level: a gap that is
/// clear in the table, half as large again as its floor and more than its standard deviation above it, is open as well.
pub fn held_out(trials: &[TrialResidual]) -> Vec<HeldOutGap> {
    let channels = trials
        .iter()
        .find_map(|t| t.residuals.as_ref().map(Vec::len));
    (0..channels.unwrap_or(0))
        .map(|c| channel(trials, c))
        .collect()
}

fn channel(trials: &[TrialResidual], c: usize) -> HeldOutGap {
    let tests: Vec<usize> = (0..trials.len()).filter(|&t| trials[t].test).collect();
    let left: Vec<(usize, Vec<Piece>)> = tests
        .iter()
        .filter_map(|&t| {
            let residuals = trials[t].residuals.as_ref()?;
            let counted: Vec<(usize, f64)> = counted(&trials[t].counted[c], &residuals[c]);
            Some((t, pieces(&counted, trials[t].rate)))
        })
        .collect();
    let size = mean(left.iter().flat_map(|(_, own)| own)).map(libm::sqrt);
    let Some((floor, freedom)) = [true, false]
        .into_iter()
        .find_map(|test| floor(trials, c, test))
    else {
        return HeldOutGap {
            size,
            floor: None,
            floor_std: None,
            open: None,
        };
    };
    let missing = tests.iter().find(|&&t| trials[t].residuals.is_none());
    let open_everywhere = |&trial: &usize| {
        let end = trials[trial].counted[c].len() as f64 / trials[trial].rate;
        OpenSpan {
            trial,
            span: (0.0, end),
            size: f64::INFINITY,
        }
    };
    let count: usize = left.iter().map(|(_, own)| own.len()).sum();
    // Pieces of the test trials scatter as those of the deviations do.
    let own = freedom.each * count as f64;
    let relative = 0.5 / freedom.all + 0.5 / own.max(1.0);
    let mut gap = HeldOutGap {
        size,
        floor: Some(floor),
        floor_std: Some(floor * libm::sqrt(relative)),
        open: missing.map(open_everywhere),
    };
    if let Some(size) = size {
        let ratio = size / (floor * (1.0 + TOLERATED_EXCESS));
        let plain = size > floor * f64::max(OPEN_GAP, 1.0 + UNCERTAIN * libm::sqrt(relative));
        let beyond_chance = fisher(ratio * ratio, own.max(1.0), freedom.all) > LEVEL;
        if gap.open.is_none() && (plain || beyond_chance) {
            gap.open = left
                .iter()
                .filter_map(|(t, own)| worst(*t, own, floor * floor))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .map(|(_, open)| open);
        }
    }
    gap
}

/// Degrees of freedom of a mean square: of all its pieces, and of one.
struct Freedom {
    all: f64,
    each: f64,
}

/// What trials of a role differ by from the mean of their repeats; `None` where none has a repeat.
fn floor(trials: &[TrialResidual], c: usize, test: bool) -> Option<(f64, Freedom)> {
    let mut all: Vec<Piece> = Vec::new();
    let mut independent = 0.0;
    let mut groups: Vec<usize> = trials.iter().map(|t| t.group).collect();
    groups.sort_unstable();
    groups.dedup();
    for group in groups {
        let members: Vec<&TrialResidual> = trials
            .iter()
            .filter(|t| t.group == group && t.residuals.is_some())
            .collect();
        if members.len() < 2 {
            continue;
        }
        let n = members.len() as f64;
        let length = members
            .iter()
            .map(|t| t.counted[c].len())
            .max()
            .unwrap_or(0);
        let of = |t: &TrialResidual, i: usize| t.residuals.as_ref().map_or(0.0, |r| r[c][i]);
        // At every sample those that last so long.
        let present = |i: usize| {
            let lasting = members
                .iter()
                .filter(move |t| t.counted[c].get(i) == Some(&true));
            lasting.map(|t| of(t, i)).collect::<Vec<f64>>()
        };
        let means: Vec<Option<(f64, f64)>> = (0..length)
            .map(|i| {
                let values = present(i);
                let n = values.len() as f64;
                (values.len() > 1)
                    .then(|| (values.iter().sum::<f64>() / n, libm::sqrt(n / (n - 1.0))))
            })
            .collect();
        let used: Vec<&&TrialResidual> = members.iter().filter(|t| t.test == test).collect();
        let mut made = 0;
        for member in &used {
            let deviation: Vec<(usize, f64)> = (0..member.counted[c].len())
                .filter(|&i| member.counted[c][i])
                .filter_map(|i| means[i].map(|(mean, scale)| (i, scale * (of(member, i) - mean))))
                .collect();
            let own = pieces(&deviation, member.rate);
            made += own.len();
            all.extend(own);
        }
        // Deviations of all members from their own mean have one degree of freedom less than members.
        independent += made as f64 * f64::min(1.0, (n - 1.0) / used.len().max(1) as f64);
    }
    let square = mean(all.iter())?;
    let count = all.len() as f64;
    let scatter = all
        .iter()
        .map(|p| (p.square - square) * (p.square - square))
        .sum::<f64>();
    let variance = scatter / (count - 1.0).max(1.0);
    // A piece has at least one degree of freedom, and a single one has no scatter.
    let each = if variance > 0.0 {
        2.0 * square * square / variance
    } else {
        1.0
    };
    let freedom = Freedom {
        all: (each * independent).max(1.0),
        each,
    };
    (square > 0.0).then(|| (libm::sqrt(square), freedom))
}

fn counted(counts: &[bool], residual: &[f64]) -> Vec<(usize, f64)> {
    let all = std::iter::zip(residual, counts).enumerate();
    all.filter(|(_, (_, counted))| **counted)
        .map(|(i, (v, _))| (i, *v))
        .collect()
}

fn pieces(samples: &[(usize, f64)], rate: f64) -> Vec<Piece> {
    let length = ((PIECE * rate) as usize).max(1);
    let whole = samples.chunks(length).filter(|p| 2 * p.len() >= length);
    whole
        .map(|piece| Piece {
            square: piece.iter().map(|(_, v)| v * v).sum::<f64>() / piece.len() as f64,
            count: piece.len(),
            span: (
                piece[0].0 as f64 / rate,
                (piece[piece.len() - 1].0 + 1) as f64 / rate,
            ),
        })
        .collect()
}

fn mean<'p>(pieces: impl Iterator<Item = &'p Piece>) -> Option<f64> {
    let (sum, count) = pieces.fold((0.0, 0), |(s, n), p| {
        (s + p.square * p.count as f64, n + p.count)
    });
    (count > 0).then(|| sum / count as f64)
}

/// The run of pieces that exceeds the floor by most, and by how much.
fn worst(trial: usize, pieces: &[Piece], floor: f64) -> Option<(f64, OpenSpan)> {
    let allowed = floor * (1.0 + TOLERATED_EXCESS) * (1.0 + TOLERATED_EXCESS);
    let mut best: Option<(f64, usize, usize)> = None;
    let (mut sum, mut start) = (0.0, 0);
    for (i, piece) in pieces.iter().enumerate() {
        if sum <= 0.0 {
            (sum, start) = (0.0, i);
        }
        sum += piece.square - allowed;
        if best.is_none_or(|(most, ..)| sum > most) {
            best = Some((sum, start, i));
        }
    }
    best.map(|(sum, start, end)| {
        let own = &pieces[start..=end];
        let size = libm::sqrt(mean(own.iter()).unwrap_or(0.0));
        (
            sum,
            OpenSpan {
                trial,
                span: (own[0].span.0, own[own.len() - 1].span.1),
                size,
            },
        )
    })
}

/// A ratio of mean squares as a standard normal variable.
fn fisher(ratio: f64, above: f64, below: f64) -> f64 {
    let root = libm::cbrt(ratio);
    let (a, b) = (2.0 / (9.0 * above), 2.0 / (9.0 * below));
    (root * (1.0 - b) - (1.0 - a)) / libm::sqrt(a + root * root * b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers between −1 and 1.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let next = |_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        (0..count).map(next).collect()
    }

    fn trials(seed: u64, bump: f64) -> Vec<TrialResidual> {
        (0..6)
            .map(|t| {
                let mut residual = noise(seed * 100 + t, 600);
                for v in &mut residual[200..300] {
                    *v += bump;
                }
                TrialResidual {
                    group: t as usize / 3,
                    test: t % 3 == 2,
                    rate: 50.0,
                    residuals: Some(vec![residual]),
                    counted: vec![vec![true; 600]],
                }
            })
            .collect()
    }

    #[test]
    fn noise_alone_leaves_no_gap_open_and_a_bump_is_placed() {
        let open = (1..200)
            .filter(|&seed| held_out(&trials(seed, 0.0))[0].open.is_some())
            .count();
        assert!(open <= 1, "{open}");
        let gap = held_out(&trials(7, 1.5))[0];
        let open = gap.open.expect("a gap that is 1.4 times the floor");
        assert_eq!(open.span, (4.0, 6.0));
        assert!(gap.size > gap.floor && gap.floor_std < gap.floor);
    }

    #[test]
    fn a_test_trial_that_cannot_be_simulated_is_open() {
        let mut trials = trials(3, 0.0);
        trials[5].residuals = None;
        assert_eq!(held_out(&trials)[0].open.map(|o| o.trial), Some(5));
    }

    /// Three seconds of each trial are little data at the level of the test.
    #[test]
    fn a_gap_that_anybody_sees_is_open() {
        let open = |bump: f64| {
            let short = |seed| {
                let mut trials = trials(seed, bump);
                for trial in &mut trials {
                    let own = trial.residuals.as_mut().expect("residuals");
                    own[0] = own[0][150..300].to_vec();
                    trial.counted[0].truncate(150);
                }
                trials
            };
            let seeds = 1..200;
            seeds
                .filter(|&s| held_out(&short(s))[0].open.is_some())
                .count()
        };
        // Without a bump, and where it makes the gap 1.7 and 2 times its floor.
        let [none, more, twice] = [0.0, 1.0, 1.25].map(open);
        assert!(none <= 1, "{none}");
        assert!(more >= 190 && twice >= 198, "{more} {twice}");
    }

    #[test]
    fn quantiles_of_fisher_match_tables() {
        // 0.999 quantiles: Abramowitz, Stegun, table 26.9: F(10, 20) = 5.08, F(30, 60) = 2.55.
        assert!((fisher(5.08, 10.0, 20.0) - LEVEL).abs() < 0.05);
        assert!((fisher(2.55, 30.0, 60.0) - LEVEL).abs() < 0.05);
    }
}
