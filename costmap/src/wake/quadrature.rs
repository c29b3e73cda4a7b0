//! Adaptive integration between knots: Gauss-Kronrod, 7 nodes inside 15.
//!
//! Nodes and weights of the rule are those of QUADPACK's `qk15` (Piessens, de Doncker-Kapenga, Überhuber
//! and Kahaner 1983).

/// Positive nodes on [-1, 1]; every second one, from the second on, is a node of the 7-point Gauss rule.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS_WEIGHTS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Halvings after which a piece is taken as it is: 2⁻²⁴ of a leg is shorter than any flow structure,
/// and only a jump that is not among the knots comes so far.
const MAX_HALVINGS: u32 = 24;

/// How much further apart the two rules may be than the error asked for. Their difference is the error of the seven
/// nodes; that of the fifteen, whose value is kept, is hundreds of times smaller on smooth pieces.
const DIFFERENCE_ALLOWED: f64 = 10.0;

/// Integral of two functions at once over the pieces between `knots` (ascending), each to `relative_error` of its
/// estimated total. A piece is settled when both functions are.
pub(crate) fn integrate(
    mut f: impl FnMut(f64) -> [f64; 2],
    knots: &[f64],
    relative_error: f64,
) -> [f64; 2] {
    let pieces: Vec<Piece> = knots
        .windows(2)
        .filter(|k| k[1] > k[0])
        .map(|k| Piece::new(&mut f, k[0], k[1], 0))
        .collect();
    let Some(length) = knots
        .last()
        .zip(knots.first())
        .map(|(end, start)| end - start)
    else {
        return [0.0; 2];
    };
    let coarse = [0, 1].map(|i| pieces.iter().map(|p| p.kronrod[i].abs()).sum::<f64>());

    let mut sum = [0.0; 2];
    // A stack, left piece on top: pieces are added in the order of time.
    let mut open: Vec<Piece> = pieces.into_iter().rev().collect();
    while let Some(piece) = open.pop() {
        let share = (piece.to - piece.from) / length;
        let settled = (0..2).all(|i| {
            let allowed = DIFFERENCE_ALLOWED
                * relative_error
                * (coarse[i] * share).max(piece.kronrod[i].abs());
            (piece.kronrod[i] - piece.gauss[i]).abs() <= allowed
        });
        if settled || piece.halvings >= MAX_HALVINGS {
            sum[0] += piece.kronrod[0];
            sum[1] += piece.kronrod[1];
            continue;
        }
        let middle = f64::midpoint(piece.from, piece.to);
        open.push(Piece::new(&mut f, middle, piece.to, piece.halvings + 1));
        open.push(Piece::new(&mut f, piece.from, middle, piece.halvings + 1));
    }
    sum
}

/// One interval with its two estimates.
struct Piece {
    from: f64,
    to: f64,
    halvings: u32,
    kronrod: [f64; 2],
    gauss: [f64; 2],
}

impl Piece {
    fn new(f: &mut impl FnMut(f64) -> [f64; 2], from: f64, to: f64, halvings: u32) -> Self {
        let (centre, half) = (f64::midpoint(from, to), (to - from) / 2.0);
        let mut piece = Self {
            from,
            to,
            halvings,
            kronrod: [0.0; 2],
            gauss: [0.0; 2],
        };
        for (index, (node, weight)) in NODES.into_iter().zip(KRONROD_WEIGHTS).enumerate() {
            let mut values = f(centre - half * node);
            if node > 0.0 {
                let mirrored = f(centre + half * node);
                values = [values[0] + mirrored[0], values[1] + mirrored[1]];
            }
            for (i, value) in values.into_iter().enumerate() {
                piece.kronrod[i] += half * weight * value;
                if index % 2 == 1 {
                    piece.gauss[i] += half * GAUSS_WEIGHTS[index / 2] * value;
                }
            }
        }
        piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_integrate_the_polynomials_they_promise() {
        for degree in (0..=22).step_by(2) {
            let exact = 2.0 / f64::from(degree + 1);
            let piece = Piece::new(&mut |x: f64| [x.powi(degree); 2], -1.0, 1.0, 0);
            // Rounding of sixteen-digit weights: a few 1e-16 a node.
            assert!(
                (piece.kronrod[0] - exact).abs() < 1e-14,
                "Kronrod, degree {degree}"
            );
            if degree <= 13 {
                assert!(
                    (piece.gauss[0] - exact).abs() < 1e-14,
                    "Gauss, degree {degree}"
                );
            }
        }
    }

    #[test]
    fn a_narrow_peak_between_knots_is_resolved() {
        let width = 1e-3;
        let peak = |x: f64| [1.0 / (1.0 + (x / width).powi(2)), 1.0];
        let [area, length] = integrate(peak, &[-1.0, 0.0, 2.0], 1e-6);
        let exact = width * ((1.0 / width).atan() + (2.0 / width).atan());
        // The error asked for.
        assert!((area / exact - 1.0).abs() < 1e-6 && (length - 3.0).abs() < 1e-12);
    }

    #[test]
    fn no_interval_has_no_integral() {
        assert_eq!(integrate(|_| [1.0; 2], &[], 1e-3), [0.0; 2]);
        assert_eq!(integrate(|_| [1.0; 2], &[2.0], 1e-3), [0.0; 2]);
        assert_eq!(integrate(|_| [1.0; 2], &[2.0, 2.0], 1e-3), [0.0; 2]);
    }
}
