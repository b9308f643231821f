//! Contours and lattices of sweeps, shards, correlations of a calibration.

mod region {
    use stickslip::calibrate::region::correlations;

    #[test]
    fn analytic_correlations_of_lines_and_of_a_square() {
        let points = |f: fn(f64, f64) -> [f64; 2]| -> Vec<Vec<f64>> {
            let square = (0..25).map(|k| (f64::from(k % 5), f64::from(k / 5)));
            square.map(|(x, y)| f(x, y).to_vec()).collect()
        };
        let coefficient = |sample: &[Vec<f64>]| correlations(sample)[0].coefficient;
        assert!((coefficient(&points(|x, _| [x, 3.0 - 2.0 * x])) + 1.0).abs() < 1e-12);
        assert!((coefficient(&points(|x, _| [x, 1.0 + x])) - 1.0).abs() < 1e-12);
        assert!(coefficient(&points(|x, y| [x, y])).abs() < 1e-12);
        assert!(coefficient(&points(|x, _| [x, 1.0])).is_nan());
    }
}

mod contour {
    use stickslip::sweep::lattice::contours;

    /// A bilinear function is reproduced on the edges: on every contour x + 2 y equals the level.
    #[test]
    fn analytic_contours_of_a_plane_are_straight() {
        let nodes = [7, 5];
        let values: Vec<f64> = (0..35)
            .map(|k| (k % 7) as f64 / 6.0 + 2.0 * (k / 7) as f64 / 4.0)
            .collect();
        let lines = contours(nodes, &values, 1.23, None);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() > 7);
        for [x, y] in &lines[0] {
            assert!((x + 2.0 * y - 1.23).abs() < 1e-14);
        }
    }

    /// A circle about a corner of the grid: the points are on it, however coarse the grid.
    #[test]
    fn analytic_contours_of_a_known_function_are_exact() {
        let radius = |[x, y]: [f64; 2]| x.hypot(y);
        let nodes = [4, 4];
        let values: Vec<f64> = (0..16)
            .map(|k| radius([(k % 4) as f64 / 3.0, (k / 4) as f64 / 3.0]))
            .collect();
        let lines = contours(nodes, &values, 0.8, Some(&radius));
        assert_eq!(lines.len(), 1);
        for &point in &lines[0] {
            assert!((radius(point) - 0.8).abs() < 1e-6, "{point:?}");
        }
    }
}

mod lattice {
    use stickslip::sweep::lattice::{Edge, Lattice};

    /// The lines of a condition, with every point that was evaluated.
    fn traced(nodes: [usize; 2], refinements: u32, condition: impl Fn([f64; 2]) -> bool) -> (Lattice, Vec<Vec<Edge>>) {
        let mut lattice = Lattice::new(nodes, refinements);
        loop {
            for node in lattice.unknown() {
                let met = condition(lattice.share(node));
                lattice.set(node, met);
            }
            if !lattice.refine() {
                break;
            }
        }
        let lines = lattice.lines();
        (lattice, lines)
    }

    #[test]
    fn analytic_a_disk_has_one_closed_line_around_it() {
        let disk = |[x, y]: [f64; 2]| (x - 0.5).hypot(y - 0.4) < 0.3;
        let (lattice, lines) = traced([9, 7], 3, disk);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        for edge in &lines[0] {
            let [a, b] = edge.ends().map(|node| disk(lattice.share(node)));
            assert_ne!(a, b);
        }
        // A convex region crosses each column and row that it meets twice: 2 (2 r) (64 + 48) edges, including the
        // ends.
        let expected = 2.0 * 0.6 * f64::from(lattice.size[0] + lattice.size[1]);
        assert!(
            (lines[0].len() as f64 - expected).abs() < 6.0,
            "{} {expected}",
            lines[0].len()
        );
    }

    #[test]
    fn analytic_a_strip_has_two_open_lines() {
        let (lattice, lines) = traced([9, 9], 2, |[x, y]| (0.3..0.7).contains(&(x + 0.1 * y)));
        assert_eq!(lines.len(), 2);
        for line in lines {
            let kept = line.iter().filter(|edge| edge.along_x);
            let rows: Vec<u32> = kept.map(|edge| edge.node.1).collect();
            let found = (rows.iter().min(), rows.iter().max());
            assert_eq!(found, (Some(&0), Some(&lattice.size[1])));
        }
    }
}

mod shard {
    use stickslip::sweep::Shard;

    fn parsed(text: &str, variables: &[(&str, &str)]) -> Result<Shard, String> {
        let of = |name: &str| {
            let found = variables
                .iter()
                .find(|(key, _)| key.strip_prefix("SLURM_ARRAY_TASK_").unwrap_or(key) == &name[17..]);
            found.map(|(_, value)| (*value).to_owned())
        };
        Shard::parse(text, &of)
    }

    #[test]
    fn analytic_a_shard_is_given_or_the_place_in_a_job_array() {
        let shard = |index, count| Ok(Shard::new(index, count).unwrap());
        assert_eq!(parsed("3/8", &[]), shard(3, 8));
        for (id, min, max, step, count, index) in [
            ("4", "1", "4", "1", "4", 4),
            ("0", "0", "3", "1", "4", 1),
            ("3", "0", "3", "1", "4", 4),
            ("9", "5", "9", "2", "3", 3),
        ] {
            let variables = [("ID", id), ("MIN", min), ("MAX", max), ("STEP", step), ("COUNT", count)];
            assert_eq!(parsed("slurm", &variables), shard(index, count.parse().unwrap()));
        }
        for text in ["0/4", "5/4", "1/0", "1/20000000", "a/b", "3", "", "-1/4", "1/4/2"] {
            assert!(parsed(text, &[]).unwrap_err().contains("is no shard"), "{text}");
        }
        assert!(
            parsed("slurm", &[])
                .unwrap_err()
                .contains("SLURM_ARRAY_TASK_ID is not set")
        );
        // An array of individually chosen numbers, such as 1,4,6.
        let listed = [("ID", "1"), ("MIN", "1"), ("MAX", "6"), ("COUNT", "3")];
        assert!(parsed("slurm", &listed).unwrap_err().contains("is not clear"));
        let odd = [("ID", "one"), ("MIN", "1"), ("MAX", "3"), ("COUNT", "3")];
        assert!(parsed("slurm", &odd).unwrap_err().contains("not a whole number"));
    }
}
