//! Literature values of the segments of the arm, as initial values and as priors.
//!
//! * de Leva, P. (1996), Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J. Biomech. 29, table 4:
//!   means of 100 young men (73.0 kg, 1.741 m) and 15 young women (61.9 kg, 1.735 m), between joint centres.
//! * Zatsiorsky, Seluyanov (1983, 1985): regressions of moments of inertia on body mass and height of the same men, and
//!   standard deviations of masses, centres of mass and moments.
//!
//! ```
//! use arm_core::anthropometry::{Grip, Part, Sex, Subject};
//! let subject = Subject::new(78.0, 1.80, Sex::Male)?;
//! let upper_arm = subject.prior(Part::UpperArm, Some(0.322), Grip::Neutral)?;
//! assert!(f64::abs(upper_arm.mass.value - 2.114) < 0.0005); // table 4.10 of the thesis
//! assert!(f64::abs(upper_arm.com.value - 0.186) < 0.0005);
//! # Ok::<(), arm_core::Invalid>(())
//! ```

use crate::{Invalid, Segment};

/// Sex, as the tables distinguish it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sex {
    /// Values of men.
    Male,
    /// Values of women.
    Female,
}

/// A segment of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Shoulder joint centre to elbow joint centre.
    UpperArm,
    /// Elbow joint centre to wrist joint centre.
    Forearm,
    /// Wrist joint centre to the third knuckle (metacarpale III).
    Hand,
}

/// The segments of the arm, proximal first.
pub const PARTS: [Part; 3] = [Part::UpperArm, Part::Forearm, Part::Hand];

/// An axis of rotation through the centre of mass of a segment, in the anatomical position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// From back to front.
    Sagittal,
    /// From side to side: flexion in the sagittal plane turns about it.
    Transverse,
    /// Along the segment.
    Longitudinal,
}

/// How the hand is turned against the plane of motion, which determines its radius of gyration.
///
/// Upper arm and forearm turn about their transverse axis in either case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// Thumb up, the palm in the plane of motion, as on a vertical handle: about the sagittal axis of the hand.
    Neutral,
    /// The palm up or down, as on a horizontal handle: about its transverse axis.
    Flat,
}

/// A value and its standard deviation among people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Expected value.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// Prior of a segment from the literature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPrior {
    /// Length, measured or scaled \[m\].
    pub length: f64,
    /// Mass \[kg\].
    pub mass: Expected,
    /// Centre of mass from the proximal joint \[m\].
    pub com: Expected,
    /// Moment of inertia about the centre of mass \[kg m²\].
    pub inertia: Expected,
}

impl SegmentPrior {
    /// The segment with the expected values.
    pub fn segment(&self) -> Segment<f64> {
        Segment {
            length: self.length,
            mass: self.mass.value,
            com: [self.com.value, 0.0],
            inertia: self.inertia.value,
        }
    }
}

/// Mean and standard deviation of the relative mass in Zatsiorsky's men \[%\] (table 2.1 of the thesis).
const RELATIVE_MASS: [[f64; 2]; 3] = [[2.70, 0.24], [1.63, 0.14], [0.61, 0.08]];

/// A row of de Leva's table 4.
struct Shape {
    /// Mass \[% of body mass\].
    mass: f64,
    /// Mean length in the sample \[m\].
    length: f64,
    /// Centre of mass from the proximal joint, of the length.
    com: f64,
    /// Radii of gyration about the sagittal, transverse and longitudinal axis, of the length.
    radii: [f64; 3],
}

const fn shape(part: Part, sex: Sex) -> Shape {
    let (mass, length, com, radii) = match (part, sex) {
        (Part::UpperArm, Sex::Male) => (2.71, 0.2817, 0.5772, [0.285, 0.269, 0.158]),
        (Part::Forearm, Sex::Male) => (1.62, 0.2689, 0.4574, [0.276, 0.265, 0.121]),
        (Part::Hand, Sex::Male) => (0.61, 0.0862, 0.7900, [0.628, 0.513, 0.401]),
        (Part::UpperArm, Sex::Female) => (2.55, 0.2751, 0.5754, [0.278, 0.260, 0.148]),
        (Part::Forearm, Sex::Female) => (1.38, 0.2643, 0.4559, [0.261, 0.257, 0.094]),
        (Part::Hand, Sex::Female) => (0.56, 0.0780, 0.7474, [0.531, 0.454, 0.335]),
    };
    Shape {
        mass,
        length,
        com,
        radii,
    }
}

/// Mean height of the sample of de Leva's table \[m\].
const fn sample_height(sex: Sex) -> f64 {
    match sex {
        Sex::Male => 1.741,
        Sex::Female => 1.735,
    }
}

/// `B0 + B1·W + B2·H` with W in kg and H in cm, and the residual standard deviation.
struct Line([f64; 4]);

impl Line {
    fn at(&self, subject: &Subject, unit: f64) -> Expected {
        let [b0, b1, b2, sd] = self.0;
        Expected {
            value: unit * (b0 + b1 * subject.body_mass + b2 * 100.0 * subject.height),
            sd: unit * sd,
        }
    }
}

/// Moments of inertia \[kg cm²\] about the sagittal, transverse and longitudinal axis.
const INERTIA: [[Line; 3]; 3] = [
    [
        Line([-250.7, 1.56, 1.512, 27.6]),
        Line([-232.0, 1.525, 1.343, 26.6]),
        Line([-16.9, 0.662, 0.0435, 12.5]),
    ],
    [
        Line([-64.0, 0.95, 0.34, 10.2]),
        Line([-67.9, 0.855, 0.376, 9.6]),
        Line([5.66, 0.306, -0.088, 2.9]),
    ],
    [
        Line([-19.5, 0.17, 0.116, 3.7]),
        Line([-13.68, 0.088, 0.092, 2.7]),
        Line([-6.26, 0.0762, 0.0347, 1.8]),
    ],
];
/// Residual standard deviations of Zatsiorsky's regressions of the centre of mass \[m\]. They were measured from bony
/// landmarks, and so hold for de Leva's joint centres in size only.
const COM_SD: [f64; 3] = [0.0140, 0.0114, 0.0110];

/// A person, described by the inputs of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subject {
    body_mass: f64,
    height: f64,
    sex: Sex,
}

impl Subject {
    /// A person from body mass \[kg\] and height \[m\].
    ///
    /// # Errors
    /// [`Invalid`] outside 20 to 300 kg and 1.0 to 2.5 m, where the tables do not apply (this also refuses a height in cm).
    pub fn new(body_mass: f64, height: f64, sex: Sex) -> Result<Self, Invalid> {
        within("body mass", body_mass, 20.0, 300.0)?;
        within("height", height, 1.0, 2.5)?;
        Ok(Self {
            body_mass,
            height,
            sex,
        })
    }

    /// Mass of a segment by de Leva's percentage \[kg\].
    ///
    /// The standard deviation is that of Zatsiorsky's men relative to their mean, for both sexes: de Leva states none.
    pub fn mass(&self, part: Part) -> Expected {
        let value = self.body_mass * shape(part, self.sex).mass / 100.0;
        let [mean, sd] = RELATIVE_MASS[part as usize];
        Expected {
            value,
            sd: value * sd / mean,
        }
    }

    /// Length of a segment by scaling de Leva's mean with height \[m\]: geometric similarity, used where no
    /// length was measured.
    pub fn mean_length(&self, part: Part) -> f64 {
        shape(part, self.sex).length * self.height / sample_height(self.sex)
    }

    /// Moment of inertia about an axis through the centre of mass by de Leva's radii of gyration \[kg m²\].
    pub fn inertia(&self, part: Part, length: f64, axis: Axis) -> f64 {
        let radius = length * shape(part, self.sex).radii[axis as usize];
        self.mass(part).value * radius * radius
    }

    /// Prior of a segment by de Leva's table.
    ///
    /// * `length` - as measured \[m\]; by default [`Subject::mean_length`]
    ///
    /// Standard deviations: of the mass as in [`Subject::mass`]; of the centre of mass and of the inertia (relative to
    /// the regression's value for the mean man) those of Zatsiorsky's regressions.
    ///
    /// # Errors
    /// [`Invalid`] for a length outside 0.01 to 1 m.
    pub fn prior(
        &self,
        part: Part,
        length: Option<f64>,
        grip: Grip,
    ) -> Result<SegmentPrior, Invalid> {
        let length = length.unwrap_or_else(|| self.mean_length(part));
        within("segment length", length, 0.01, 1.0)?;
        let axis = match (part, grip) {
            (Part::Hand, Grip::Neutral) => Axis::Sagittal,
            _ => Axis::Transverse,
        };
        let mean_man = Self {
            body_mass: 73.0,
            height: sample_height(Sex::Male),
            sex: Sex::Male,
        };
        let typical = INERTIA[part as usize][axis as usize].at(&mean_man, 1.0);
        let inertia = self.inertia(part, length, axis);
        Ok(SegmentPrior {
            length,
            mass: self.mass(part),
            com: Expected {
                value: length * shape(part, self.sex).com,
                sd: COM_SD[part as usize],
            },
            inertia: Expected {
                value: inertia,
                sd: inertia * typical.sd / typical.value,
            },
        })
    }

    /// Moment of inertia about an axis through the centre of mass by Zatsiorsky's regression \[kg m²\]; none for women.
    ///
    /// Segments of the regressions end at bony landmarks and not at joint centres, so that they differ somewhat from de
    /// Leva's. For small people they can become negative.
    pub fn regressed_inertia(&self, part: Part, axis: Axis) -> Option<Expected> {
        (self.sex == Sex::Male).then(|| INERTIA[part as usize][axis as usize].at(self, 1e-4))
    }
}

fn within(name: &'static str, found: f64, min: f64, max: f64) -> Result<(), Invalid> {
    if !found.is_finite() {
        return Err(Invalid::NotFinite { name, index: 0 });
    }
    if found < min || found > max {
        return Err(Invalid::OutOfRange {
            name,
            index: 0,
            found,
            min,
            max,
        });
    }
    Ok(())
}
