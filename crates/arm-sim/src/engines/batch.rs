//! Many runs side by side: several in the lanes of one, groups of lanes that share their drive, sets of groups over threads.

use std::mem::discriminant;

use crate::engines::group::{Group, Outcomes};
use crate::engines::simulate::simulate;
use crate::integrators::input_buffer::InputBuffer;
use crate::preparation::prepared_run::{Prepared, commands};
use crate::{Experiment, Integrator, SimulationError};
use arm_core::simd_dispatch::has_registers_of_eight;

/// Most groups in a set. If they share a drive, it is computed once for all.
const GROUPS: usize = 8;

/// Simulates many experiments; each has the bits of [`simulate`], whatever its neighbours and the number of threads.
///
/// Neighbours that differ only in values (not in kinds of effects, steps, or the kind of drive) run side by side in one pass, eight of
/// them with AVX-512, else four; order similar experiments together.
pub fn simulate_batch<const N: usize>(
    experiments: &[Experiment<N>],
    threads: usize,
) -> Outcomes<N> {
    if has_registers_of_eight() {
        batch::<8, N>(experiments, threads)
    } else {
        batch::<4, N>(experiments, threads)
    }
}

fn batch<const L: usize, const N: usize>(
    experiments: &[Experiment<N>],
    threads: usize,
) -> Outcomes<N> {
    let groups = experiments.len().div_ceil(L);
    let threads = threads.clamp(1, groups.max(1));
    let sets: Vec<&[Experiment<N>]> = sets::<L, _>(experiments, threads).collect();
    let mut done: Vec<Outcomes<N>> = Vec::new();
    if threads == 1 {
        done.extend(sets.into_iter().map(set::<L, N>));
    } else {
        // Every thread takes each `threads`-th set: fixed, and even for runs of slowly changing cost.
        let share = &|first: usize| -> Vec<Outcomes<N>> {
            let mine = sets.iter().skip(first).step_by(threads);
            mine.map(|experiments| set::<L, N>(experiments)).collect()
        };
        let mut shares: Vec<_> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads)
                .map(|first| scope.spawn(move || share(first)))
                .collect();
            let joined = workers.into_iter().map(|worker| worker.join());
            joined
                .map(|share| share.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .map(Vec::into_iter)
                .collect()
        });
        for index in 0..sets.len() {
            done.extend(shares[index % threads].next());
        }
    }
    done.into_iter().flatten().collect()
}

/// Runs in sets of at most [`GROUPS`] groups of `L`, of nearly equal size; every thread gets the same number of sets.
fn sets<const L: usize, T>(runs: &[T], threads: usize) -> impl Iterator<Item = &[T]> {
    let groups = runs.len().div_ceil(L);
    let sets = threads * groups.div_ceil(threads * GROUPS);
    let start = move |set: usize| (set * groups / sets * L).min(runs.len());
    (0..sets).map(move |set| &runs[start(set)..start(set + 1)])
}

/// Some runs: side by side where neighbours are alike, else one by one.
fn set<const L: usize, const N: usize>(experiments: &[Experiment<N>]) -> Outcomes<N> {
    let prepared: Vec<_> = experiments.iter().map(Prepared::new).collect();
    let mut outcomes = Vec::with_capacity(prepared.len());
    for neighbours in prepared.chunk_by(|a, b| match (a, b) {
        (Ok(a), Ok(b)) => may_be_beside(a) && may_be_beside(b) && alike(a, b),
        _ => false,
    }) {
        let neighbours: Vec<_> = neighbours.iter().flatten().collect();
        // A run that is alone, or was refused.
        if neighbours.len() < 2 {
            outcomes.push(simulate(&experiments[outcomes.len()]));
            continue;
        }
        let groups: Vec<_> = neighbours.chunks(L).collect();
        for together in
            groups.chunk_by(|a, b| has_one_drive(a) && has_one_drive(b) && same_drive(a[0], b[0]))
        {
            // Where the runs fail together, for example for want of memory, each is run by itself.
            outcomes.extend(side_by_side::<L, N>(together).unwrap_or_else(|_| {
                let alone = together.iter().copied().flatten();
                alone.map(|run| simulate(run.experiment)).collect()
            }));
        }
    }
    outcomes
}

/// Whether a run may share lanes: with set-valued friction only if that is simple, and by Rk4; with [`Integrator::Imex`] not.
fn may_be_beside<const N: usize>(run: &Prepared<N>) -> bool {
    match run.integrator() {
        Integrator::Imex => false,
        Integrator::Rk4 if run.model.has_simple_friction() => true,
        Integrator::Rk4 | Integrator::SemiImplicitEuler => !run.model.has_dry,
    }
}

/// Whether two runs take the same steps.
fn alike<const N: usize>(a: &Prepared<N>, b: &Prepared<N>) -> bool {
    let kinds = |p: &Prepared<N>| -> Vec<_> {
        let effects = p.model.effects.iter();
        effects.map(|e| (e.kind, e.index, e.is_dry())).collect()
    };
    a.schedule == b.schedule
        && a.experiment.columns == b.experiment.columns
        && a.integrator() == b.integrator()
        && discriminant(&a.model.link) == discriminant(&b.model.link)
        && a.model.base.is_some() == b.model.base.is_some()
        && a.setup.is_as_commanded() == b.setup.is_as_commanded()
        && a.model.heaves == b.model.heaves
        && a.model.is_assisted == b.model.is_assisted
        && a.model.dry == b.model.dry
        && kinds(a) == kinds(b)
}

/// Whether two runs are driven in the same way, seen from the base, with the same muscle activity and assistance.
fn same_drive<const N: usize>(a: &Prepared<N>, b: &Prepared<N>) -> bool {
    a.experiment.drive == b.experiment.drive
        && a.experiment.base == b.experiment.base
        && a.experiment.activity == b.experiment.activity
        && a.experiment.assistance == b.experiment.assistance
}

/// Whether one drive, without displacement, is that of all runs of a group.
fn has_one_drive<const N: usize>(group: &[&Prepared<N>]) -> bool {
    let mut all = group.iter();
    all.all(|run| same_drive(run, group[0]) && run.setup.is_as_commanded())
}

/// Groups of at most `L` runs that go on together: one group, or several that one drive moves.
fn side_by_side<const L: usize, const N: usize>(
    groups: &[&[&Prepared<N>]],
) -> Result<Outcomes<N>, SimulationError> {
    let (first, schedule) = (groups[0][0], groups[0][0].schedule);
    let one_drive = has_one_drive(groups[0]);
    let runs = groups.iter().copied().flatten();
    // Where the drive of any run breaks, every run makes its own step.
    let mut broken: Vec<usize> = runs.flat_map(|p| p.discontinuities.steps()).collect();
    broken.sort_unstable();
    broken.dedup();
    let mut broken = broken.into_iter().peekable();
    let groups = groups.iter();
    let groups = groups.map(|runs| Group::<L, N>::new(runs, one_drive));
    let mut groups = groups.collect::<Result<Vec<_>, _>>()?;
    let mut common = InputBuffer::new(first.integrator());
    groups.iter_mut().for_each(|group| group.sample(0));
    let (mut done, mut sampled) = (0, 0);
    while done < schedule.steps && groups.iter().any(Group::goes_on) {
        let next = done + 1;
        let going = groups.iter_mut().filter(|group| group.goes_on());
        if broken.next_if_eq(&next).is_some() {
            done = next;
            going.for_each(|group| group.step_apart(next));
        } else {
            let most = schedule.smooth(done, sampled, broken.peek());
            let drive = if one_drive {
                Some(common.ahead(next, most, |half_steps, out| {
                    commands(first.experiment, &schedule, half_steps, out);
                }))
            } else {
                None
            };
            let steps = drive.map_or(most, |ahead| ahead.steps);
            going.for_each(|group| group.advance(next, steps, drive));
            done += steps;
        }
        if done == sampled + schedule.every {
            sampled = done;
            let going = groups.iter_mut().filter(|group| group.goes_on());
            going.for_each(|group| group.sample(done));
        }
    }
    Ok(groups.into_iter().flat_map(Group::finish).collect())
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};
    use arm_core::{Limits, Shape, sample_arms};

    use super::{GROUPS, Outcomes, batch, sets};
    use crate::{
        Coupling, Drive, Experiment, HandlePath, Integrator, Movement, sample_experiments, simulate,
    };

    /// Runs of several sets, which differ in their masses.
    fn runs(integrator: Integrator) -> Vec<Experiment<3>> {
        let run = |i: u32| {
            let mut run = sample_experiments::human_experiment(0.1, [0.0; 3]).expect("valid");
            run.integrator = integrator;
            for segment in &mut run.setup.segments {
                segment.mass *= 1.0 + 0.01 * f64::from(i);
            }
            run
        };
        (0..75).map(run).collect()
    }

    /// `simulate_batch` chooses 4 or 8 lanes by the processor; here both are compared with single runs.
    fn as_alone(change: impl Fn(usize, &mut Experiment<3>)) {
        for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
            let mut runs = runs(integrator);
            for (i, run) in runs.iter_mut().enumerate() {
                change(i, run);
            }
            let alone: Outcomes<3> = runs.iter().map(simulate).collect();
            for threads in [1, 3] {
                assert_eq!(batch::<4, 3>(&runs, threads), alone, "4 lanes");
                assert_eq!(batch::<8, 3>(&runs, threads), alone, "8 lanes");
            }
        }
    }

    fn lead_at(speed: f64, coupling: Coupling, run: &mut Experiment<3>) {
        let limits = Limits {
            speed,
            acceleration: 20.0 * speed,
        };
        let waypoints = [[-1.0, 0.7, 0.1], [-0.9, 0.75, 0.1]].map(Into::into);
        let movement = Movement::within(Shape::Trapezoid, &waypoints, &[limits; 3], 0.0);
        let movement = movement.expect("valid");
        let path = HandlePath::of_arm(sample_arms::human_arm(), movement);
        run.drive = Drive::Handle { path, coupling };
    }

    #[test]
    fn one_drive_of_all_runs() {
        as_alone(|_, _| ());
    }

    #[test]
    fn a_run_of_another_length_or_that_is_refused() {
        as_alone(|i, run| match i {
            21 => run.duration = 0.05,
            40 => run.setup.contact.stiffness[0] = -1.0,
            _ => (),
        });
    }

    #[test]
    fn half_of_the_runs_along_another_path() {
        as_alone(|i, run| {
            if i > 37 {
                lead_at(1.1, Coupling::Compliant, run);
            }
        });
    }

    #[test]
    fn each_run_along_a_path_of_its_own_whose_corners_lie_between_steps() {
        for coupling in [Coupling::Compliant, Coupling::Rigid] {
            as_alone(|i, run| lead_at(1.0 + 0.013 * i as f64, coupling, run));
        }
    }

    #[test]
    fn runs_that_diverge_beside_others() {
        as_alone(|i, run| {
            // All lanes of one group, and one lane of others.
            if (24..32).contains(&i) || i == 50 {
                let wild = Effect::new(Kind::Viscous, 1).with(&[-1e4 - 1e3 * i as f64]);
                run.effects = vec![wild; 1];
            } else {
                run.effects = vec![Effect::new(Kind::Viscous, 1).with(&[0.2])];
            }
        });
    }

    #[test]
    fn runs_with_dry_friction_that_reverse_at_different_times() {
        let coulomb = |joint, torque: f64, smoothing: f64| {
            Effect::new(Kind::Coulomb, joint).with(&[torque, smoothing])
        };
        as_alone(|i, run| {
            lead_at(1.0 + 0.013 * i as f64, Coupling::Compliant, run);
            let spring = Effect::new(Kind::Relaxation, 2);
            // One run diverges beside others.
            let viscosity = if i == 50 { -1e4 } else { 0.2 };
            run.effects = vec![
                Effect::new(Kind::Viscous, 1).with(&[viscosity]),
                coulomb(0, 0.1 + 0.02 * i as f64, 0.0),
                // Runs 13 and 30 have set-valued friction in other joints than their neighbours, run 40 has friction that falls with speed.
                coulomb(1, if i == 13 { 0.0 } else { 0.2 }, 0.0),
                coulomb(2, 0.05, if i == 30 { 0.01 } else { 0.0 }),
                spring,
            ];
            if i == 40 {
                run.effects
                    .push(Effect::new(Kind::Stribeck, 0).with(&[0.1, 0.06, 0.0]));
            }
        });
    }

    #[test]
    fn sets_are_even_and_hold_all_runs_in_order() {
        for (count, threads) in [(0, 1), (1, 4), (75, 1), (75, 3), (577, 2), (640, 7)] {
            let runs: Vec<usize> = (0..count).collect();
            let sets: Vec<_> = sets::<8, _>(&runs, threads).collect();
            assert_eq!(sets.concat(), runs, "{count} runs, {threads} threads");
            assert!(sets.iter().all(|set| set.len() <= 8 * GROUPS));
        }
        let runs = [(); 80];
        let lengths: Vec<usize> = sets::<8, _>(&runs, 2).map(<[()]>::len).collect();
        assert_eq!(lengths, [40, 40]);
    }
}
