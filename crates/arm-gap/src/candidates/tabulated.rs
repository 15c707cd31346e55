//! User-defined laws that are costly to evaluate: tabulated over angle and speed, once for each shape.

use std::cell::RefCell;
use std::sync::{Arc, PoisonError, RwLock};

use arm_core::effect::{CustomLaw, Info, Local, MAX_PARAMETERS, Parameters, Prior};

/// Number of tables that are kept: a fit returns to shapes it has tried.
const MOST_TABLES: usize = 24;

/// Where a law is tabulated.
///
/// Angles lie at equal distances; speeds at equal distances of `asinh(speed/knee)`: dense around rest, where dry friction
/// turns, and in proportion to the speed beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Smallest and largest angle \[rad\]. Beyond, the law keeps the value of the edge.
    pub angle: [f64; 2],
    /// Largest speed \[rad/s\].
    pub speed: f64,
    /// Speed around which distances begin to grow \[rad/s\].
    pub knee: f64,
    /// Number of angles and of speeds, at least four each.
    pub count: [usize; 2],
}

impl Grid {
    /// The angles of the table \[rad\].
    pub fn angles(&self) -> Vec<f64> {
        let n = self.count[0];
        let step = (self.angle[1] - self.angle[0]) / (n - 1) as f64;
        (0..n).map(|i| self.angle[0] + step * i as f64).collect()
    }

    /// The speeds of the table \[rad/s\].
    pub fn speeds(&self) -> Vec<f64> {
        let n = self.count[1];
        let end = libm::asinh(self.speed / self.knee);
        let step = 2.0 * end / (n - 1) as f64;
        (0..n)
            .map(|i| self.knee * libm::sinh(step * i as f64 - end))
            .collect()
    }

    /// Where a motion lies between the rows and columns of the table.
    fn place(&self, q: f64, qd: f64) -> [f64; 2] {
        let end = libm::asinh(self.speed / self.knee);
        let along = (q - self.angle[0]) / (self.angle[1] - self.angle[0]);
        let fast = 0.5 + 0.5 * libm::asinh(qd / self.knee) / end;
        let on = |share: f64, n: usize| share.clamp(0.0, 1.0) * (n - 1) as f64;
        [on(along, self.count[0]), on(fast, self.count[1])]
    }

    /// The value of a table between its points, by cubics through four of them each way.
    fn between(&self, table: &[f64], at: [f64; 2]) -> f64 {
        let [rows, columns] = self.count;
        let (i, a) = cubic(at[0], rows);
        let (j, b) = cubic(at[1], columns);
        (0..4).fold(0.0, |sum, r| {
            let row = &table[(i + r) * columns + j..][..4];
            sum + a[r] * (0..4).fold(0.0, |s, c| s + b[c] * row[c])
        })
    }
}

/// The first of four points and their weights: Lagrange's cubic, of one side at an edge.
fn cubic(at: f64, count: usize) -> (usize, [f64; 4]) {
    let first = (at as usize).clamp(1, count - 3) - 1;
    let x = at - first as f64;
    let weights = core::array::from_fn(|k| {
        (0..4)
            .filter(|&m| m != k)
            .fold(1.0, |w, m| w * (x - m as f64) / (k as f64 - m as f64))
    });
    (first, weights)
}

/// Makes the tables of a shape: one for each linear parameter, for one unit of it; angle by angle, speeds side by side.
///
/// `None` where the law fails.
pub type Tabulate = Box<dyn Fn(&[f64]) -> Option<Vec<Vec<f64>>> + Send + Sync>;

type Key = [u64; MAX_PARAMETERS];
type Tables = Arc<Vec<Vec<f64>>>;

/// A user-defined law by its tables.
pub struct Tabulated {
    info: &'static Info,
    prior: Prior,
    /// Number of leading parameters in which the torque is linear.
    linear: usize,
    grid: Grid,
    tabulate: Tabulate,
    kept: RwLock<Vec<(Key, Tables)>>,
}

thread_local! {
    /// The tables that this thread used last, with the law and the shape that they belong to.
    static LAST: RefCell<Option<(usize, Key, Tables)>> = const { RefCell::new(None) };
}

impl Tabulated {
    /// A law whose tables are made when a shape is first met.
    pub fn new(info: &'static Info, prior: Prior, grid: Grid, tabulate: Tabulate) -> Self {
        Self {
            info,
            prior,
            linear: info.parameters.iter().take_while(|p| p.linear).count(),
            grid,
            tabulate,
            kept: RwLock::new(Vec::new()),
        }
    }

    fn key(&self, p: &Parameters<f64>) -> Key {
        let mut key = [0; MAX_PARAMETERS];
        for k in self.linear..self.info.parameters.len() {
            key[k] = p[k].to_bits();
        }
        key
    }

    /// The tables of a shape; empty where the law fails.
    fn tables(&self, key: Key, p: &Parameters<f64>) -> Tables {
        let find = |kept: &Vec<(Key, Tables)>| {
            let found = kept.iter().find(|(k, _)| *k == key);
            found.map(|(_, tables)| Arc::clone(tables))
        };
        if let Some(tables) = find(&self.kept.read().unwrap_or_else(PoisonError::into_inner)) {
            return tables;
        }
        // Made outside the lock: another thread may make the same meanwhile, with the same result.
        let size = self.grid.count[0] * self.grid.count[1];
        let made = (self.tabulate)(&p[..self.info.parameters.len()])
            .filter(|t| t.len() == self.linear && t.iter().all(|t| t.len() == size));
        // A law that fails may fail once.
        let Some(made) = made else {
            return Tables::default();
        };
        let tables = Arc::new(made);
        let mut kept = self.kept.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = find(&kept) {
            return known;
        }
        if kept.len() >= MOST_TABLES {
            kept.remove(0);
        }
        kept.push((key, Arc::clone(&tables)));
        tables
    }
}

impl CustomLaw for Tabulated {
    fn info(&self) -> &'static Info {
        self.info
    }

    fn prior(&self) -> Prior {
        self.prior
    }

    fn torque(&self, p: &Parameters<f64>, at: &Local<f64>) -> f64 {
        if p[..self.linear].iter().all(|v| *v == 0.0) {
            return 0.0;
        }
        let (me, key) = (core::ptr::from_ref(self) as usize, self.key(p));
        let read = |tables: &Tables| {
            let place = self.grid.place(at.q, at.qd);
            std::iter::zip(tables.iter(), p).fold(0.0, |sum, (table, value)| {
                sum + value * self.grid.between(table, place)
            })
        };
        let known = LAST.with_borrow(|last| match last {
            Some((law, shape, tables)) if *law == me && *shape == key => Some(read(tables)),
            _ => None,
        });
        known.unwrap_or_else(|| {
            // Nothing is borrowed meanwhile: the law may simulate, and then needs tables itself.
            let tables = self.tables(key, p);
            if tables.is_empty() {
                return f64::NAN;
            }
            let torque = read(&tables);
            LAST.set(Some((me, key, tables)));
            torque
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_core::effect::{Parameter, Place};

    const INFO: Info = Info {
        kind: "spring and drag",
        place: Place::Joint,
        summary: "",
        formula: "R = k sin(q/p) + d qd |qd|",
        reference: "",
        parameters: &[
            Parameter::linear("k", "N m", -1.0, 1.0, 0.0),
            Parameter::linear("d", "N m s²/rad²", -1.0, 1.0, 0.0),
            Parameter::shape("p", "rad", 0.01, 1.0, 0.2),
        ],
        states: 0,
    };
    const GRID: Grid = Grid {
        angle: [-2.0, 2.0],
        speed: 20.0,
        knee: 0.01,
        count: [401, 257],
    };

    fn law() -> Tabulated {
        let tabulate: Tabulate = Box::new(|p| {
            let pitch = p[2];
            let (angles, speeds) = (GRID.angles(), GRID.speeds());
            let all = |f: &dyn Fn(f64, f64) -> f64| {
                angles
                    .iter()
                    .flat_map(|&q| speeds.iter().map(move |&v| f(q, v)))
                    .collect()
            };
            Some(vec![
                all(&|q, _| libm::sin(q / pitch)),
                all(&|_, v| v * v.abs()),
            ])
        });
        Tabulated::new(&INFO, Prior::FIRST, GRID, tabulate)
    }

    /// A cubic between points at distance h errs by up to 3/128 · h⁴ · the fourth derivative: 0.01⁴/0.2⁴ of a sine of 0.2 rad;
    /// 0.0648⁴ · 2⁴ of a square of the speed, which is an exponential of where it stands in the table.
    #[test]
    fn the_table_is_the_law_as_closely_as_cubics_can() {
        let law = law();
        let p = [0.7, -0.3, 0.2, 0.0, 0.0, 0.0];
        for i in 0..500 {
            let (q, qd) = (-1.9 + 0.0076 * f64::from(i), 3.0 * libm::sin(f64::from(i)));
            let exact = 0.7 * libm::sin(q / 0.2) - 0.3 * qd * qd.abs();
            let bound = 3.0 / 128.0 * (0.7 * 6.25e-6 + 0.3 * qd * qd * 16.0 * 1.774e-5);
            assert!((law.torque(&p, &Local::moving(q, qd)) - exact).abs() < bound);
        }
    }

    #[test]
    fn other_shapes_have_other_tables_and_the_edge_is_kept() {
        let law = law();
        for pitch in [0.2, 0.5, 0.2] {
            let p = [1.0, 0.0, pitch, 0.0, 0.0, 0.0];
            let exact = libm::sin(1.0 / pitch);
            assert!((law.torque(&p, &Local::moving(1.0, 0.0)) - exact).abs() < 1e-6);
            assert_eq!(
                law.torque(&p, &Local::moving(2.0, 0.0)),
                law.torque(&p, &Local::moving(5.0, 0.0))
            );
        }
        assert_eq!(law.kept.read().map(|k| k.len()).ok(), Some(2));
    }

    #[test]
    fn a_law_that_failed_once_is_evaluated_again() {
        let good = law().tabulate;
        let first = std::sync::atomic::AtomicBool::new(true);
        let once = move |p: &[f64]| {
            let fails = first.swap(false, std::sync::atomic::Ordering::Relaxed);
            if fails { None } else { good(p) }
        };
        let law = Tabulated::new(&INFO, Prior::FIRST, GRID, Box::new(once));
        let p = [1.0, 0.0, 0.2, 0.0, 0.0, 0.0];
        assert!(law.torque(&p, &Local::moving(1.0, 0.0)).is_nan());
        assert!((law.torque(&p, &Local::moving(1.0, 0.0)) - libm::sin(5.0)).abs() < 1e-6);
    }

    #[test]
    fn a_law_may_evaluate_another_one() {
        let inner: &'static Tabulated = Box::leak(Box::new(law()));
        let good = law().tabulate;
        let nested = move |p: &[f64]| {
            let torque = inner.torque(&[1.0, 0.0, 0.2, 0.0, 0.0, 0.0], &Local::moving(0.0, 0.0));
            good(p).filter(|_| torque == 0.0)
        };
        let law = Tabulated::new(&INFO, Prior::FIRST, GRID, Box::new(nested));
        let p = [1.0, 0.0, 0.5, 0.0, 0.0, 0.0];
        assert!((law.torque(&p, &Local::moving(1.0, 0.0)) - libm::sin(2.0)).abs() < 1e-6);
    }

    #[test]
    fn a_law_that_fails_is_not_a_number() {
        let law = Tabulated::new(&INFO, Prior::FIRST, GRID, Box::new(|_| None));
        assert!(law.torque(&[1.0; 6], &Local::moving(0.0, 0.0)).is_nan());
        assert_eq!(law.torque(&[0.0; 6], &Local::moving(0.0, 0.0)), 0.0);
    }
}
