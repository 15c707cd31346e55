use crate::noise::gap;
use arm_numerics::NumericsError;
use arm_numerics::signal::filter::Butterworth;

/// Agreement with scipy: the same recursion with sections in another order.
const TOLERANCE: f64 = 1e-11;

/// A column that needs no transcendental function, so that scipy gets the same bits.
fn column() -> Vec<f64> {
    (0..60)
        .map(|i| ((i * 37) % 101) as f64 / 50.0 - 1.0 + 0.02 * i as f64)
        .collect()
}

struct Reference {
    order: usize,
    cutoff: f64,
    rate: f64,
    /// Samples 0, 1, 30, 58, 59 of `sosfiltfilt(butter(order, cutoff, fs=rate, output="sos"), column)`.
    both: [f64; 5],
}

/// scipy 1.17.1, numpy 2.4.6.
const REFERENCES: [Reference; 6] = [
    Reference {
        order: 1,
        cutoff: 5.0,
        rate: 50.0,
        both: [
            -0.9942671897717282,
            -0.5692354524131182,
            0.8376896469330484,
            1.3099571658265967,
            1.4161991976506685,
        ],
    },
    Reference {
        order: 2,
        cutoff: 5.0,
        rate: 50.0,
        both: [
            -1.0008070251072427,
            -0.6117979909310045,
            0.8063975846137997,
            1.3216496769291035,
            1.4171243627522196,
        ],
    },
    Reference {
        order: 3,
        cutoff: 3.0,
        rate: 50.0,
        both: [
            -1.0042900361899236,
            -0.7356471346234976,
            0.7176802791655336,
            1.3269661489413662,
            1.4149976948256666,
        ],
    },
    Reference {
        order: 4,
        cutoff: 5.0,
        rate: 50.0,
        both: [
            -1.002362189442473,
            -0.6296576992776197,
            0.7957072712520648,
            1.311973675244198,
            1.4235839537882955,
        ],
    },
    Reference {
        order: 5,
        cutoff: 12.0,
        rate: 100.0,
        both: [
            -0.9979807192994604,
            -0.6011967270161103,
            0.8354281602958986,
            1.339935642259391,
            1.4200023267604949,
        ],
    },
    Reference {
        order: 8,
        cutoff: 1.0,
        rate: 100.0,
        both: [
            -1.4904269894424858,
            -1.464450179127286,
            -1.0760230196828822,
            -1.0417117214533522,
            -1.0416608976477177,
        ],
    },
];

#[test]
fn equals_scipy() {
    let x = column();
    for reference in REFERENCES {
        let Reference {
            order,
            cutoff,
            rate,
            ..
        } = reference;
        let filter = Butterworth::low_pass(order, cutoff, rate).expect("in range");
        let y = filter.both_ways(&x).expect("long enough");
        let together = filter
            .both_ways_all(&vec![x.to_vec(); 5])
            .expect("long enough");
        assert!(together.iter().all(|column| *column == y), "other bits");
        let picked: Vec<f64> = [0, 1, 30, 58, 59].iter().map(|&i| y[i]).collect();
        assert!(
            gap(&picked, &reference.both) < TOLERANCE,
            "order {order}: {picked:?}"
        );
    }
}

#[test]
fn half_power_is_where_the_documentation_says() {
    let (cutoff, rate) = (5.0, 50.0);
    let phase = |i: usize| core::f64::consts::TAU * cutoff / rate * i as f64;
    let wave: Vec<f64> = (0..1000).map(|i| libm::sin(phase(i) + 0.4)).collect();
    let gains = |filter: Butterworth, gain: f64| {
        let out = filter.both_ways(&wave).expect("long enough");
        let expected: Vec<f64> = wave.iter().map(|v| gain * v).collect();
        gap(&out[300..700], &expected[300..700])
    };
    for order in [1, 2, 3, 4, 7] {
        let single = Butterworth::low_pass(order, cutoff, rate).expect("in range");
        assert!(gains(single, 0.5) < 1e-12);
        let double = Butterworth::for_both_ways(order, cutoff, rate).expect("in range");
        assert!(gains(double, 0.5_f64.sqrt()) < 1e-12);
    }
}

#[test]
fn constants_and_ramps_pass_unchanged() {
    let filter = Butterworth::low_pass(4, 5.0, 50.0).expect("in range");
    let constant = filter.both_ways(&[2.5; 40]).expect("long enough");
    assert!(constant.iter().all(|y| (y - 2.5).abs() < 1e-12));
    let ramp: Vec<f64> = (0..400).map(|i| 0.1 * i as f64).collect();
    let out = filter.both_ways(&ramp).expect("long enough");
    assert!(gap(&out[100..300], &ramp[100..300]) < 1e-9);
}

#[test]
fn refuses_short_columns_and_impossible_filters() {
    let filter = Butterworth::low_pass(4, 5.0, 50.0).expect("in range");
    assert_eq!(filter.padding(), 15);
    assert_eq!(
        Butterworth::low_pass(3, 5.0, 50.0)
            .expect("in range")
            .padding(),
        12
    );
    assert!(matches!(
        filter.both_ways(&[0.0; 15]),
        Err(NumericsError::TooFew {
            found: 15,
            expected: 16,
            ..
        })
    ));
    assert!(filter.both_ways(&[f64::NAN; 30]).is_err());
    for (order, cutoff, rate) in [
        (0, 5.0, 50.0),
        (21, 5.0, 50.0),
        (2, 25.0, 50.0),
        (2, 0.0, 50.0),
        (2, 5.0, -1.0),
        (2, f64::NAN, 50.0),
    ] {
        assert!(Butterworth::low_pass(order, cutoff, rate).is_err());
    }
}
