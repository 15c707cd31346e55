//! The search for what a model lacks: ask the whole catalogue, look ahead, converge by simulation, go back.

use std::cmp::Ordering;

use arm_core::effect::Effect;

use crate::GapError;
use crate::anchor::Anchor;
use crate::apart::{Apart, Line};
use crate::candidate::{Candidate, Library};
use crate::chance::chi_square_tail;
use crate::fit::{Fitted, Precision};
use crate::hypothesis::Hypothesis;
use crate::misfit::{Lack, lack_of_fit};
use crate::scan::{Choice, Scan};
use crate::session::Sight;
use crate::study::Study;

/// Share of all that is explained that an effect must explain, whatever the others are.
const FLOOR: f64 = 0.003;
/// The same without repeats: what sensors and a rigid model get wrong cannot be told from noise then, and an effect may be no more
/// than what comes nearest to it.
const FLOOR_UNREPEATED: f64 = 0.03;
/// Most disturbances of single trials that are named.
const DISTURBANCES: usize = 4;
/// Frequency below which a ripple is asked like other effects \[Hz\]: movements and what a model lacks of them reach that far.
const SLOW: f64 = 3.0;
/// Most effects that are named.
const MOST: usize = 6;
/// Choices that are converged by simulation in each round.
const CONTENDERS: usize = 4;
/// Effects that a choice may add in one round: what is invisible alone may be plain together.
const AHEAD: usize = 3;
/// Choices that are kept while looking ahead.
const WIDTH: usize = 12;
/// An effect that explains as much but for this (in units of twice the log-likelihood) is an alternative.
const TIE: f64 = 10.0;
/// Alternatives that are converged by simulation for each named effect.
const RIVALS: usize = 5;
/// Share of what a named effect gains that another must gain to first order to be converged in its place.
const RIVAL: f64 = 0.6;
/// Times that a better alternative may take the place of a named effect.
const EXCHANGES: usize = 4;

/// One effect that was named.
#[derive(Clone, Debug)]
pub struct Named {
    /// Its place in the hypothesis.
    pub slot: usize,
    /// Probability of such a gain by chance, with all candidates that were asked.
    pub p_value: f64,
    /// Share of what can be explained that is lost without it.
    pub share: f64,
    /// What would explain the same: the candidate, and how much worse it does.
    pub alternatives: Vec<Alternative>,
}

/// Another effect that would explain what a named one does.
#[derive(Clone, Debug)]
pub struct Alternative {
    /// The question that it answers.
    pub candidate: Candidate,
    /// The effect as it fits best.
    pub effect: Effect<f64>,
    /// How much worse it explains the data, in units of twice the log-likelihood.
    pub worse: f64,
    /// Squared cosine between what the two would show.
    pub likeness: f64,
}

/// An alternative, fitted.
struct Rival<const N: usize> {
    alternative: Alternative,
    fitted: Fitted<N>,
}

/// One round of the search.
#[derive(Clone, Debug)]
pub struct Rung {
    /// What was added, best first: the candidates and what they gained.
    pub tried: Vec<(Vec<Candidate>, f64)>,
    /// Cost before it.
    pub before: f64,
    /// Cost after it.
    pub after: f64,
}

/// A candidate of the last scan: what it would still explain, and the smallest size that would have been named.
#[derive(Clone, Debug)]
pub struct Ruled {
    /// The candidate.
    pub candidate: Candidate,
    /// What it would gain.
    pub gain: f64,
    /// What it would have to gain.
    pub price: f64,
    /// Smallest size of its first free parameter that would have been named.
    pub smallest: f64,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Finding<const N: usize> {
    /// The model after refitting what was never exact.
    pub calibrated: Fitted<N>,
    /// The model with the named effects.
    pub amended: Fitted<N>,
    /// The named effects, those that explain most first.
    pub named: Vec<Named>,
    /// What is not the same in every trial.
    pub apart: Vec<Apart>,
    /// Rounds of the search.
    pub ladder: Vec<Rung>,
    /// How well the amended model is known.
    pub precision: Precision,
    /// Lack of fit of the calibrated and of the amended model.
    pub lack: [Lack; 2],
    /// What else was asked.
    pub ruled: Vec<Ruled>,
    /// Misfit for each degree of freedom.
    pub scale: f64,
}

/// What a search tells while it works: what it does, and how far it is (0 to 1).
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// A fitted hypothesis with the simulation that it was followed from.
type Settled<'a, const N: usize> = (Fitted<N>, Anchor<'a, N>);

/// What was found of effects that last.
struct Hunt<'a, const N: usize> {
    calibrated: Fitted<N>,
    /// What the calibrated model leaves, at the same samples and with the same noise.
    before: Lack,
    current: Fitted<N>,
    anchor: Anchor<'a, N>,
    ladder: Vec<Rung>,
    ruled: Vec<Ruled>,
    /// Number of candidates.
    asked: f64,
    scale: f64,
}

impl<'a, const N: usize> Study<'a, N> {
    /// Searches for what the model lacks.
    ///
    /// First what is not the same in every trial, told by what repeats differ in; then what lasts; then a ripple of the
    /// robot, in what is left; and whatever was set apart or found on the way is asked once more.
    ///
    /// # Errors
    /// [`GapError`] where the model as given cannot be simulated or fitted.
    pub fn search(&mut self, progress: Progress<'_>) -> Result<Finding<N>, GapError> {
        progress("calibrating", 0.0);
        let mut settled = self.calibrate()?;
        if !self.repeated {
            self.measure_noise(&settled.1)?;
            settled = self.calibrate()?;
        }
        let led = self.session.sight == Sight::Led;
        let mut apart = Vec::new();
        let mut periodic = None;
        if led {
            progress("looking at single trials", 0.05);
            if let Some(found) = self.rhythm(&settled.1, Line::BetweenRepeats)? {
                self.take_out(&settled.1, &found)?;
                apart.push(found);
                settled = self.calibrate_anew()?;
            }
            let (fitted, anchor, found) = self.disturbances(settled)?;
            settled = (fitted, anchor);
            apart.extend(found);
        }
        let mut hunt = self.hunt(settled, periodic, progress)?;
        if led && let Some(found) = self.rhythm(&hunt.anchor, Line::OfTheRobot)? {
            let [frequency, phase] = found.wave();
            if found.locked && frequency < SLOW {
                periodic = Some([frequency, phase]);
            } else {
                self.take_out(&hunt.anchor, &found)?;
                apart.push(found);
            }
            let again = self.calibrate_anew()?;
            hunt = self.hunt(again, periodic, progress)?;
        }
        if apart.iter().any(|a| a.trial.is_some()) && !hunt.current.asked.is_empty() {
            // What looked like a disturbance may have been what was named since.
            self.take_back();
            apart.retain(|a| a.trial.is_none());
            self.measure_noise(&self.anchor(&hunt.current.hypothesis)?)?;
            let settled = self.settle(hunt.current.hypothesis, hunt.current.asked)?;
            let (fitted, anchor, found) = self.disturbances(settled)?;
            apart.extend(found);
            let from;
            (hunt.calibrated, from) = self.settle(hunt.calibrated.hypothesis, Vec::new())?;
            hunt.before = lack_of_fit(self, &from, &hunt.calibrated);
            (hunt.current, hunt.anchor) =
                self.pruned((fitted, anchor), &hunt.calibrated, hunt.scale)?;
        }
        let Hunt {
            mut calibrated,
            before,
            current,
            anchor,
            ladder,
            ruled,
            asked,
            scale,
        } = hunt;
        let (mut amended, anchor, named) = self.judged(
            (current, anchor),
            &calibrated,
            (asked, scale, periodic),
            progress,
        )?;
        progress("measuring what is left", 0.9);
        let mut precision = self.precision(&anchor, &amended, scale)?;
        let lack = [before, lack_of_fit(self, &anchor, &amended)];
        if let Some((hypothesis, _)) = self.refined(&calibrated) {
            calibrated.hypothesis = hypothesis;
        }
        if let Some((hypothesis, known)) = self.refined(&amended) {
            (amended.hypothesis, precision) = (hypothesis, known);
        }
        progress("done", 1.0);
        Ok(Finding {
            calibrated,
            amended,
            named,
            apart,
            ladder,
            precision,
            lack,
            ruled,
            scale,
        })
    }

    /// Looks for effects that last, round by round.
    fn hunt(
        &mut self,
        (mut calibrated, mut anchor): Settled<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<Hunt<'a, N>, GapError> {
        let mut before = lack_of_fit(self, &anchor, &calibrated);
        let mut current = calibrated.clone();
        let mut ladder = Vec::new();
        let (mut asked, mut scale, mut ruled) = (1.0, 1.0, Vec::new());
        for round in 0..MOST {
            progress("asking the catalogue", 0.1 + 0.1 * round as f64);
            let library = Library::build(self, &anchor, periodic)?;
            let scan = Scan::new(self, &current, &anchor, &library)?;
            asked = library.candidates.len() as f64;
            scale = scan.scale;
            ruled = self.ruled(&library, &scan);
            let room = MOST - current.asked.len();
            let Some((better, rung)) =
                self.round((&calibrated, &current), &anchor, (&library, &scan), room)?
            else {
                break;
            };
            // What can be followed but not simulated is no answer.
            let Ok(settled) = self.settle(better.hypothesis, better.asked) else {
                break;
            };
            ladder.push(rung);
            (current, anchor) = settled;
            (current, anchor) = self.pruned((current, anchor), &calibrated, scale)?;
            if self.leave_out_rest(&anchor) {
                self.measure_noise(&self.anchor(&current.hypothesis)?)?;
                let from;
                (calibrated, from) = self.settle(calibrated.hypothesis, Vec::new())?;
                before = lack_of_fit(self, &from, &calibrated);
                let settled = self.settle(current.hypothesis, current.asked)?;
                (current, anchor) = self.pruned(settled, &calibrated, scale)?;
            }
            // Without repeats a second look has only its own residual to tell noise from what the model lacks.
            if current.asked.len() >= MOST || !self.repeated {
                break;
            }
        }
        Ok(Hunt {
            calibrated,
            before,
            current,
            anchor,
            ladder,
            ruled,
            asked,
            scale,
        })
    }

    /// Leaves out of single trials what disturbs them, the clearest first.
    #[allow(clippy::type_complexity)]
    fn disturbances(
        &mut self,
        (mut fitted, mut anchor): Settled<'a, N>,
    ) -> Result<(Fitted<N>, Anchor<'a, N>, Vec<Apart>), GapError> {
        let mut found = Vec::new();
        while found.len() < DISTURBANCES
            && let Some(one) = self.disturbance(&anchor, 1.0)
            && let Some(trial) = one.trial
        {
            self.leave_out(trial, one.span());
            found.push(one);
            self.measure_noise(&self.anchor(&anchor.hypothesis)?)?;
            (fitted, anchor) = self.settle(fitted.hypothesis, fitted.asked)?;
        }
        Ok((fitted, anchor, found))
    }

    /// The model as given, with everything refitted that was never exact.
    ///
    /// # Errors
    /// As [`Study::settle`].
    pub fn calibrate(&self) -> Result<Settled<'a, N>, GapError> {
        self.settle(self.session.given(), Vec::new())
    }

    /// The same after the data have changed, with the noise read anew.
    fn calibrate_anew(&mut self) -> Result<Settled<'a, N>, GapError> {
        let given = self.anchor(&self.session.given())?;
        self.measure_noise(&given)?;
        self.calibrate()
    }

    /// One round: the best choices of the scan, converged by simulation; `None` when none is worth its price.
    fn round(
        &self,
        (calibrated, current): (&Fitted<N>, &Fitted<N>),
        anchor: &Anchor<N>,
        (library, scan): (&Library, &Scan),
        room: usize,
    ) -> Result<Option<(Fitted<N>, Rung)>, GapError> {
        let fresh = |members: &[usize], c: usize| {
            let candidate = &library.candidates[c];
            let same = |other: &Candidate| {
                other.is_same_effect(&candidate.effect) && other.question == candidate.question
            };
            !current.asked.iter().any(same)
                && !members.iter().any(|&m| same(&library.candidates[m]))
        };
        let choices = scan.search(&[], AHEAD.min(room), WIDTH, &fresh);
        // Less than every effect must explain need not be converged.
        let missed = current.asked.iter().map(|c| c.kind().probe().missed);
        let least = missed.fold(0.0, f64::max) * (calibrated.cost - current.cost);
        let choices: Vec<Choice> = choices
            .into_iter()
            .filter(|c| c.gain > least * c.members.len() as f64)
            .collect();
        let mut contenders: Vec<Choice> = Vec::new();
        let most = choices.first().map_or(0.0, |c| c.worth);
        for choice in choices.iter().filter(|c| c.worth > 0.5 * most) {
            if contenders.len() >= CONTENDERS {
                break;
            }
            // Another shape of the same effects is refined by the fit, it need not be converged by itself.
            let same = |other: &Choice| {
                other.members.len() == choice.members.len()
                    && std::iter::zip(&other.members, &choice.members).all(|(&a, &b)| {
                        library.candidates[a].is_same_effect(&library.candidates[b].effect)
                    })
            };
            if !contenders.iter().any(same) {
                contenders.push(choice.clone());
            }
        }
        if let Some(single) = choices
            .iter()
            .find(|c| c.members.len() == 1 && c.worth > 0.0)
            && !contenders.iter().any(|c| c.members == single.members)
        {
            contenders.push(single.clone());
        }
        let mut best: Option<(f64, Fitted<N>)> = None;
        let mut tried = Vec::new();
        for choice in &contenders {
            let asked: Vec<Candidate> = choice
                .members
                .iter()
                .map(|&m| {
                    let mut candidate = library.candidates[m].clone();
                    candidate.price = scan.price[m] * scan.spread[m];
                    candidate
                })
                .collect();
            let Some(fitted) = self.attempt(current, (&asked, &choice.coefficients), anchor) else {
                continue;
            };
            let price: f64 = asked.iter().map(|c| c.price).sum();
            let gain = current.cost - fitted.cost;
            let worth = gain / scan.scale - price;
            tried.push((asked, gain));
            if worth > 0.0 && best.as_ref().is_none_or(|(most, _)| worth > *most) {
                best = Some((worth, fitted));
            }
        }
        tried.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(best.map(|(_, fitted)| {
            let rung = Rung {
                tried,
                before: current.cost,
                after: fitted.cost,
            };
            (fitted, rung)
        }))
    }

    /// A hypothesis with further effects, fitted; `None` where it cannot be followed.
    ///
    /// The first-order coefficients are halved until they lower the cost: effects that are strong are not linear.
    fn attempt(
        &self,
        current: &Fitted<N>,
        (asked, coefficients): (&[Candidate], &[Vec<f64>]),
        anchor: &Anchor<N>,
    ) -> Option<Fitted<N>> {
        const SHARES: [f64; 4] = [1.0, 0.5, 0.2, 0.05];
        let mut all = current.asked.clone();
        all.extend_from_slice(asked);
        let mut best: Option<Fitted<N>> = None;
        for share in SHARES {
            let mut hypothesis = current.hypothesis.clone();
            for (candidate, own) in std::iter::zip(asked, coefficients) {
                let own: Vec<f64> = own.iter().map(|b| share * b).collect();
                hypothesis.named.push(candidate.found(&own));
            }
            if let Ok(fitted) = self.fit(anchor, hypothesis, all.clone()) {
                if fitted.cost < current.cost {
                    return Some(fitted);
                }
                if best.as_ref().is_none_or(|b| fitted.cost < b.cost) {
                    best = Some(fitted);
                }
            }
        }
        best
    }

    /// A fitted hypothesis without the effect at a place, fitted again; of infinite cost where nothing goes without it.
    fn without(
        &self,
        fitted: &Fitted<N>,
        slot: usize,
        anchor: &Anchor<N>,
    ) -> Result<Fitted<N>, GapError> {
        let mut hypothesis: Hypothesis<N> = fitted.hypothesis.clone();
        let mut asked = fitted.asked.clone();
        hypothesis.named.remove(slot);
        asked.remove(slot);
        match self.fit(anchor, hypothesis.clone(), asked.clone()) {
            // What the effect had held up may be impossible without it: then from the segments as given.
            Err(GapError::Simulation { .. }) => {
                hypothesis.segments = [[0.0; 3]; N];
                match self.fit(anchor, hypothesis.clone(), asked.clone()) {
                    // Or too far away to be followed.
                    Err(GapError::Simulation { .. }) => {
                        let settled = self.settle(hypothesis.clone(), asked.clone());
                        Ok(settled.map_or_else(
                            |_| Fitted {
                                hypothesis,
                                asked,
                                cost: f64::INFINITY,
                                residuals: fitted.residuals.clone(),
                            },
                            |(less, _)| less,
                        ))
                    }
                    other => other,
                }
            }
            other => other,
        }
    }

    /// Goes back: effects that are no longer worth their price are taken out.
    fn pruned(
        &self,
        (mut fitted, mut anchor): Settled<'a, N>,
        calibrated: &Fitted<N>,
        scale: f64,
    ) -> Result<Settled<'a, N>, GapError> {
        let floor = match self.repeated {
            true => FLOOR,
            false => FLOOR_UNREPEATED,
        };
        while !fitted.asked.is_empty() {
            let mut weakest: Option<(f64, Fitted<N>)> = None;
            let without = (0..fitted.asked.len()).map(|slot| self.without(&fitted, slot, &anchor));
            let without = without.collect::<Result<Vec<_>, _>>()?;
            let gains: Vec<f64> = without.iter().map(|l| l.cost - fitted.cost).collect();
            // Without repeats nothing tells how large the noise is: an effect must also foretell parts of the movement from others.
            let foretold = match self.repeated {
                true => None,
                false => Some(self.foretold(&anchor, &fitted)?),
            };
            for (slot, less) in without.into_iter().enumerate() {
                let mut gain = gains[slot];
                if let Some(with) = foretold
                    && gain.is_finite()
                {
                    gain = gain.min(self.foretold(&anchor, &less)? - with);
                }
                // Less may be the imperfect shape of another one.
                let others = (0..gains.len()).filter(|&o| o != slot && gains[o].is_finite());
                let least = others
                    .map(|o| fitted.asked[o].kind().probe().missed * gains[o])
                    .fold(floor * (calibrated.cost - fitted.cost), f64::max);
                let worth = gain / scale - fitted.asked[slot].price;
                let worth = if gain < least {
                    worth.min(gain - least)
                } else {
                    worth
                };
                if worth < 0.0 && weakest.as_ref().is_none_or(|(least, _)| worth < *least) {
                    weakest = Some((worth, less));
                }
            }
            let Some((_, less)) = weakest else { break };
            (fitted, anchor) = self.settle(less.hypothesis, less.asked)?;
        }
        Ok((fitted, anchor))
    }

    /// What could stand in the place of each named effect; a better one takes it.
    fn judged(
        &self,
        (mut fitted, mut anchor): Settled<'a, N>,
        calibrated: &Fitted<N>,
        (asked, scale, periodic): (f64, f64, Option<[f64; 2]>),
        progress: Progress<'_>,
    ) -> Result<(Fitted<N>, Anchor<'a, N>, Vec<Named>), GapError> {
        let mut exchanges = 0;
        'again: loop {
            let mut named = Vec::new();
            let library = match fitted.asked.len() {
                0 => None,
                _ => Some(Library::build(self, &anchor, periodic)?),
            };
            for (slot, library) in (0..fitted.asked.len()).zip(std::iter::repeat(&library)) {
                progress(
                    "comparing alternatives",
                    0.7 + 0.2 * slot as f64 / fitted.asked.len() as f64,
                );
                let less = self.without(&fitted, slot, &anchor)?;
                let gain = (less.cost - fitted.cost).min(f64::MAX);
                let rivals = match library {
                    Some(library) if less.cost.is_finite() => {
                        self.rivals(&fitted, (slot, &less), (&anchor, library), scale)?
                    }
                    _ => Vec::new(),
                };
                if exchanges < EXCHANGES
                    && let Some(better) = rivals.iter().find(|r| {
                        self.takes_over(&r.alternative, (&fitted.asked[slot], gain / scale))
                    })
                {
                    let better = better.fitted.clone();
                    (fitted, anchor) = self.settle(better.hypothesis, better.asked)?;
                    exchanges += 1;
                    continue 'again;
                }
                let candidate = &fitted.asked[slot];
                let chance = chi_square_tail(gain / scale, candidate.width());
                named.push(Named {
                    slot,
                    p_value: (asked * chance).min(1.0),
                    share: gain / (calibrated.cost - fitted.cost).max(gain),
                    alternatives: rivals
                        .into_iter()
                        .map(|r| r.alternative)
                        .filter(|a| a.worse <= self.tie(candidate, gain / scale))
                        .collect(),
                });
            }
            named.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.slot.cmp(&b.slot)));
            return Ok((fitted, anchor, named));
        }
    }

    /// How much worse another effect may explain the data and still be an alternative to one that gained so much.
    ///
    /// Without repeats nothing tells a law that is not exact from another one: what its kind may miss of what it shows decides nothing.
    fn tie(&self, own: &Candidate, gain: f64) -> f64 {
        match self.repeated {
            true => TIE,
            false => TIE.max(own.kind().probe().missed * gain),
        }
    }

    /// Whether another effect takes the place of a named one.
    ///
    /// The better one does. Without repeats a tie goes to the plainer law, the one with fewer parameters or, with as many, the one that
    /// stands before it in the catalogue: an intricate one bends itself to what sensors and a rigid model get wrong.
    fn takes_over(&self, rival: &Alternative, (own, gain): (&Candidate, f64)) -> bool {
        const BETTER: f64 = 0.05;
        let plain = |c: &Candidate| {
            let place = self.session.kinds().position(|k| k == c.kind());
            (c.kind().info().parameters.len(), place)
        };
        let handicap = match plain(&rival.candidate).cmp(&plain(own)) {
            _ if self.repeated => 0.0,
            Ordering::Less => self.tie(own, gain),
            Ordering::Equal => 0.0,
            Ordering::Greater => -self.tie(own, gain),
        };
        rival.worse < handicap - BETTER
    }

    /// Other effects in the place of one, fitted, the best first.
    fn rivals(
        &self,
        fitted: &Fitted<N>,
        (slot, less): (usize, &Fitted<N>),
        (anchor, library): (&Anchor<N>, &Library),
        scale: f64,
    ) -> Result<Vec<Rival<N>>, GapError> {
        let own = &fitted.asked[slot];
        let gain = less.cost - fitted.cost;
        let scan = Scan::new(self, less, anchor, library)?;
        let mut singles: Vec<Choice> = (0..scan.len())
            .filter(|&c| {
                let candidate = &library.candidates[c];
                !own.is_same_effect(&candidate.effect)
                    && !less
                        .asked
                        .iter()
                        .any(|a| a.is_same_effect(&candidate.effect))
            })
            .filter_map(|c| scan.evaluate(&[c]))
            .filter(|c| c.gain > RIVAL * gain)
            .collect();
        singles.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let twin = (0..scan.len()).find(|&c| {
            own.is_same_effect(&library.candidates[c].effect)
                && own.question == library.candidates[c].question
        });
        let mut seen: Vec<&Candidate> = Vec::new();
        let mut rivals = Vec::new();
        for choice in &singles {
            let candidate = &library.candidates[choice.members[0]];
            if seen.iter().any(|s| s.is_same_effect(&candidate.effect)) {
                continue;
            }
            if seen.len() >= RIVALS {
                break;
            }
            seen.push(candidate);
            let mut asked = candidate.clone();
            asked.price = scan.price[choice.members[0]] * scan.spread[choice.members[0]];
            let Some(rival) = self.attempt(
                less,
                (std::slice::from_ref(&asked), &choice.coefficients),
                anchor,
            ) else {
                continue;
            };
            let worse = (rival.cost - fitted.cost) / scale + asked.price - own.price;
            let likeness = twin.map_or(0.0, |t| scan.likeness(t, choice.members[0]));
            let Some(&effect) = rival.hypothesis.named.last() else {
                continue;
            };
            rivals.push(Rival {
                alternative: Alternative {
                    candidate: asked,
                    effect,
                    worse,
                    likeness,
                },
                fitted: rival,
            });
        }
        rivals.sort_by(|a, b| a.alternative.worse.total_cmp(&b.alternative.worse));
        Ok(rivals)
    }

    fn ruled(&self, library: &Library, scan: &Scan) -> Vec<Ruled> {
        (0..scan.len())
            .map(|c| Ruled {
                candidate: library.candidates[c].clone(),
                gain: scan.evaluate(&[c]).map_or(0.0, |choice| choice.gain) / scan.scale,
                price: scan.price[c] * scan.spread[c],
                smallest: scan.smallest_seen(c),
            })
            .collect()
    }
}
