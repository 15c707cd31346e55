//! Units as products of powers of the SI base units and the radian.

/// A unit with its exponents.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Name as in Modelica: `N.m.s/rad`.
    pub name: String,
    /// Exponents of kg, m, s and rad.
    pub exponents: [i32; 4],
}

/// Symbols with their exponents of kg, m, s and rad.
const SYMBOLS: [(&str, [i32; 4]); 9] = [
    ("1", [0, 0, 0, 0]),
    ("kg", [1, 0, 0, 0]),
    ("m", [0, 1, 0, 0]),
    ("s", [0, 0, 1, 0]),
    ("rad", [0, 0, 0, 1]),
    ("Hz", [0, 0, -1, 0]),
    ("N", [1, 1, -2, 0]),
    ("J", [1, 2, -2, 0]),
    ("W", [1, 2, -3, 0]),
];

/// Reads a unit such as `N m s/rad` or `kg m²`: factors parted by spaces, what follows the slash divides.
///
/// Nothing for a symbol or an exponent that is not known.
pub fn unit(text: &str) -> Option<Unit> {
    let mut exponents = [0; 4];
    for (part, sign) in text.split('/').zip([1, -1]) {
        for factor in part.split(' ') {
            let (symbol, power) = match factor.chars().last()? {
                '²' => (factor.trim_end_matches('²'), 2),
                '³' => (factor.trim_end_matches('³'), 3),
                _ => (factor, 1),
            };
            let (_, own) = SYMBOLS.iter().find(|(known, _)| *known == symbol)?;
            for (sum, own) in exponents.iter_mut().zip(own) {
                *sum += sign * power * own;
            }
        }
    }
    (text.split('/').count() <= 2).then(|| Unit {
        name: text.replace(' ', ".").replace('²', "2").replace('³', "3"),
        exponents,
    })
}
