//! Division of the work on a full window into units for single control periods.

/// What is left to do with a full window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Work {
    /// Nothing.
    Idle,
    /// To wait for so many periods.
    Wait(u32),
    /// To forget, and to begin with a row: 0 is a prior row of one unknown, others are those of the joints.
    Row(usize),
    /// To end with that row.
    Rest(usize),
    /// To prepare what the bounds change.
    Copy,
    /// To solve, and to find the unknown that lies farthest outside its bounds.
    Solve,
    /// To fix an unknown to its upper or lower bound.
    Fix {
        /// Which.
        unknown: usize,
        /// To which of its bounds.
        upper: bool,
    },
    /// To publish the values, and to count what they leave of the window.
    Publish,
    /// To compute the standard deviations of as many unknowns as there are joints, from this one on.
    Deviations(usize),
}

impl Work {
    /// About as many instructions as a unit takes on a Cortex-M4F, for `[joints, unknowns]`. It only serves to share the units
    /// among the periods evenly.
    pub fn cost(self, [n, p]: [usize; 2]) -> usize {
        // What is beyond a place of a triangle, and each of its rows.
        let rotation = |from: usize| {
            let rows = p - from.min(p);
            13 * rows * rows / 2 + 40 * rows
        };
        match self {
            Self::Idle => 0,
            // A period each.
            Self::Wait(_) => usize::MAX,
            Self::Row(_) => 20 * p + rotation(0) - rotation(split(p)),
            Self::Rest(_) => rotation(split(p)),
            Self::Copy => 2 * p * p,
            Self::Solve => 6 * p * p + 36 * p,
            Self::Fix { unknown, .. } => rotation(unknown + 1) + 40 * p,
            Self::Publish => 40 * n * p,
            Self::Deviations(_) => 2 * n * p * p + 30 * p,
        }
    }
}

/// The unknown at which the work of taking in a row is halved.
pub(super) const fn split(unknowns: usize) -> usize {
    unknowns / 3
}

/// What a period may spend so that all work on a window, were two unknowns of three fixed to a bound, is done in `free` periods;
/// at least the largest of the usual units. Were it more, the values would be published with the next window.
pub(super) fn budget(size: [usize; 2], free: u32) -> usize {
    let mut budget = [
        Work::Row(0),
        Work::Solve,
        Work::Publish,
        Work::Deviations(0),
    ]
    .into_iter()
    .fold(0, |most, work| most.max(work.cost(size)));
    // Each time a sixteenth more: in the end a single period takes all.
    for _ in 0..STEPS {
        if periods_taken(size, budget) <= free {
            break;
        }
        budget += budget / 16 + 1;
    }
    budget
}

/// Steps in which a budget grows seven-thousandfold.
const STEPS: usize = 144;

/// Periods that the most work takes.
fn periods_taken(size: [usize; 2], budget: usize) -> u32 {
    let [n, p] = size;
    let (mut periods, mut spent) = (1, 0);
    let mut take = |work: Work| {
        let cost = work.cost(size);
        if spent > 0 && spent + cost > budget {
            periods += 1;
            spent = 0;
        }
        spent += cost;
    };
    for row in 0..=n {
        take(Work::Row(row));
        take(Work::Rest(row));
    }
    take(Work::Copy);
    for unknown in 0..2 * p / 3 {
        take(Work::Solve);
        take(Work::Fix {
            unknown,
            upper: true,
        });
    }
    take(Work::Solve);
    take(Work::Publish);
    for unknown in (0..p).step_by(n.max(1)) {
        take(Work::Deviations(unknown));
    }
    periods
}
