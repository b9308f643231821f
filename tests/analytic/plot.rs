//! The parts of figures: lines, colours, letters, axes.

mod lines {
    use stickslip::continuation::{Branch, BranchPoint, EndReason, Special};
    use stickslip::cycle::CycleStability;
    use stickslip::plot::branches::quantity::Value;
    use stickslip::plot::branches::{joined, links, pieces};

    fn branch(points: &[(CycleStability, Option<Special>)]) -> Branch {
        let point = |(k, &(stability, special)): (usize, &(CycleStability, Option<Special>))| BranchPoint {
            value: k as f64,
            period: f64::NAN,
            position: (0.0, 0.0),
            relative_velocity: (1.0, 1.0),
            stability,
            unstable: 0,
            spectrum: Vec::new(),
            sticks: 0,
            shortest_stick: f64::NAN,
            margin: f64::NAN,
            sequence: String::new(),
            special,
            time: 0.0,
            state: Vec::new(),
        };
        Branch {
            steady: true,
            multiple: None,
            parent: None,
            points: points.iter().enumerate().map(point).collect(),
            end: EndReason::Range,
        }
    }

    /// The pieces meet at the Hopf point, and a branch that is stable on one side of it is not drawn as stable on the
    /// other.
    #[test]
    fn analytic_pieces_share_the_point_where_stability_changes() {
        use CycleStability::{Neutral, Stable, Unstable};
        let hopf = branch(&[
            (Unstable, None),
            (Unstable, None),
            (Neutral, Some(Special::Hopf)),
            (Stable, None),
            (Stable, None),
        ]);
        let xs = |stability| {
            let found = pieces(&hopf, stability, |_, _| 0.0);
            let of = |piece: &Vec<(f64, f64)>| piece.iter().map(|point| point.0).collect::<Vec<_>>();
            found.iter().map(of).collect::<Vec<_>>()
        };
        assert_eq!(xs(Unstable), [vec![0.0, 1.0, 2.0]]);
        assert_eq!(xs(Stable), [vec![2.0, 3.0, 4.0]]);
        assert!(xs(Neutral).is_empty());
    }

    /// At a fold rounding decides about the stability of the point: the lines next to it do not depend on it.
    #[test]
    fn property_lines_do_not_depend_on_the_stability_of_a_special_point() {
        use CycleStability::{Neutral, Stable, Unstable};
        for own in [Stable, Unstable, Neutral] {
            let fold = branch(&[
                (Stable, None),
                (Stable, None),
                (own, Some(Special::Fold)),
                (Unstable, None),
            ]);
            assert_eq!(links(&fold), [Stable, Stable, Unstable], "{own:?}");
        }
    }

    /// A missing value makes a gap.
    #[test]
    fn analytic_a_missing_value_is_a_gap() {
        let all = branch(&[(CycleStability::Stable, None); 5]);
        let of: Value = |_, point| if point.value == 2.0 { f64::NAN } else { point.value };
        let found = pieces(&all, CycleStability::Stable, of);
        assert_eq!(found, [vec![(0.0, 0.0), (1.0, 1.0)], vec![(3.0, 3.0), (4.0, 4.0)]]);
    }

    /// Both directions from one start make one line from end to end.
    #[test]
    fn analytic_two_directions_are_one_line() {
        let up = vec![(1.0, 0.0), (2.0, 0.0)];
        let down = vec![(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)];
        let apart = vec![(1.0, 3.0), (2.0, 3.0)];
        let found = joined(vec![up, down, apart.clone()], PartialEq::eq);
        assert_eq!(found, [vec![(2.0, 0.0), (1.0, 0.0), (0.5, 0.0), (0.0, 0.0)], apart]);
    }
}

mod marks {
    use stickslip::continuation::Special;
    use stickslip::plot::branches::mark;

    #[test]
    fn property_marks_differ_in_shape_and_name() {
        let marks: Vec<_> = Special::ALL.into_iter().map(mark).collect();
        for (k, a) in marks.iter().enumerate() {
            for b in &marks[..k] {
                assert!(a.0 != b.0 && a.2 != b.2, "{a:?} {b:?}");
            }
        }
    }
}

mod colors {
    use stickslip::model::Mode;
    use stickslip::plot::style::{BLUE, LIGHTNESS, RGBColor, ground, of_mode, shade, shade_of_code};

    /// L* of a colour, from its luminance (ITU-R BT.709): its brightness in a grey print and for colour-blind eyes.
    fn lightness(RGBColor(r, g, b): RGBColor) -> f64 {
        let part = |value: u8| match f64::from(value) / 255.0 {
            value if value <= 0.04045 => value / 12.92,
            value => ((value + 0.055) / 1.055).powf(2.4),
        };
        let luminance: f64 = 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
        116.0 * luminance.cbrt() - 16.0
    }

    /// 64 steps, each lighter than the one before by the amount of an even scale; rounding to 8 bits is below half a
    /// unit of L*.
    #[test]
    fn analytic_the_scale_is_even_in_grey() {
        let step = (LIGHTNESS.1 - LIGHTNESS.0) / 63.0;
        for k in 0..64 {
            let own = lightness(shade(f64::from(k) / 63.0));
            assert!((own - (LIGHTNESS.0 + step * f64::from(k))).abs() < 0.5, "{k}: {own}");
        }
    }

    /// The ground of a mode is its colour of the figures, mixed with white by its opacity, and curves have the figures' colours.
    #[test]
    fn analytic_pages_have_the_colours_of_the_figures() {
        let css = include_str!("../../data/page/light.css").to_ascii_lowercase();
        let value = |name: &str| {
            let (_, rest) = css
                .split_once(&format!("--{name}: "))
                .unwrap_or_else(|| panic!("no colour {name}"));
            rest.split(';').next().unwrap().to_owned()
        };
        let hex = |RGBColor(r, g, b): RGBColor| format!("#{r:02x}{g:02x}{b:02x}");
        let modes = [
            ("slip", Mode::SlipForward),
            ("slip", Mode::Engaged),
            ("backward", Mode::SlipBackward),
            ("stick", Mode::Stick),
            ("separated", Mode::Separated),
        ];
        for (name, mode) in modes {
            let (RGBColor(r, g, b), opacity) = ground(mode);
            let mixed = |part: u8| (255.0 + (f64::from(part) - 255.0) * opacity).round() as u8;
            assert_eq!(value(name), hex(RGBColor(mixed(r), mixed(g), mixed(b))), "{name}");
        }
        for (name, mode) in [
            ("blue", Mode::SlipForward),
            ("vermillion", Mode::Stick),
            ("purple", Mode::SlipBackward),
        ] {
            assert_eq!(value(name), hex(of_mode(mode)), "{name}");
        }
        assert_eq!(value("blue"), hex(BLUE));
    }

    #[test]
    fn analytic_ends_and_beyond() {
        assert_eq!(shade(-1.0), shade(0.0));
        assert_eq!(shade(f64::NAN), shade(0.0));
        assert_eq!(shade(7.0), shade(1.0));
        assert_eq!(shade_of_code(0, 1), shade(0.0));
    }
}

mod pages {
    use stickslip::plot::style::{NAMED, RGBColor};

    const LIGHT: &str = include_str!("../../data/page/light.css");
    const DARK: &str = include_str!("../../data/page/dark.css");

    /// Value of a variable of a style.
    fn color(style: &str, name: &str) -> RGBColor {
        let (_, rest) = style
            .split_once(&format!("--{name}: #"))
            .unwrap_or_else(|| panic!("{name}"));
        let digit = |at: usize| u8::from_str_radix(&rest[at..at + 2], 16).unwrap();
        RGBColor(digit(0), digit(2), digit(4))
    }

    /// Every colour of a curve is in light and dark pages what it is in figures. Grey is the ink of texts in light pages, and
    /// darker there.
    #[test]
    fn analytic_curves_of_pages_have_the_colours_of_figures() {
        for (name, light, dark) in NAMED.into_iter().filter(|named| named.0 != "grey") {
            assert_eq!((color(LIGHT, name), color(DARK, name)), (light, dark), "{name}");
        }
        assert_eq!(
            color(DARK, "grey"),
            NAMED.iter().find(|named| named.0 == "grey").unwrap().2
        );
    }
}

mod font {
    use stickslip::plot::text::{face, text_width, wrapped_title};

    /// DejaVu Sans: "0" is 1303 of 2048 units wide, and so is every digit.
    #[test]
    fn published_widths() {
        assert_eq!(text_width("0000", 2048.0), 4.0 * 1303.0);
        assert_eq!(text_width("7", 2048.0), 1303.0);
        assert!(text_width("ωᵣ φ₁′ θ µ −", 1.0) > 5.0);
    }

    #[test]
    fn analytic_a_long_title_breaks_after_its_colon() {
        let title = "Stator surface before the first stick: diverges, ×1.505 per turn";
        let width = text_width(title, 1.0);
        let halves = ["Stator surface before the first stick:", "diverges, ×1.505 per turn"];
        assert_eq!(wrapped_title(title, 1.0, 0.95 * width), halves);
        assert_eq!(wrapped_title(title, 1.0, 1.01 * width), [title]);
        let found = wrapped_title("no colon here", 1.0, text_width("no colon", 1.0));
        assert_eq!(found, ["no colon", "here"]);
    }

    /// If the part before the colon needs two lines, the rest follows it in the second.
    #[test]
    fn analytic_a_very_long_title_is_not_broken_after_its_colon() {
        let found = wrapped_title("one two three four: five", 1.0, text_width("one two three", 1.0));
        assert_eq!(found, ["one two three", "four: five"]);
    }

    #[test]
    fn analytic_every_symbol_of_the_labels_is_in_the_font() {
        let face = face();
        for c in "ωᵣφ₁₂θµ−′₀αΔ×·≤²³¹⁻".chars() {
            assert!(face.glyph_index(c).is_some(), "{c}");
        }
    }
}

mod labels {
    use stickslip::case::Motion;
    use stickslip::plot::labels::{common, of_variable};
    use stickslip::record::channel;
    use stickslip::results::schema;

    #[test]
    fn property_every_channel_has_a_label_of_its_own() {
        let channels: Vec<_> = channel::all().collect();
        for (k, channel) in channels.iter().enumerate() {
            let same = channels.iter().position(|other| other.label == channel.label);
            assert!(!channel.label.is_empty() && same == Some(k), "{}", channel.name);
        }
    }

    #[test]
    fn analytic_common_words() {
        let variables = schema::trajectory().variables;
        let axis = |channel: &&str| {
            let variable = variables.iter().find(|variable| variable.name == *channel).unwrap();
            of_variable(variable, Motion::Rotation, true)
        };
        let name = |channels: &[&str]| common(&channels.iter().map(axis).collect::<Vec<_>>()).name;
        assert_eq!(name(&["phi2_dot", "phi1_dot"]), "surface speed");
        assert_eq!(name(&["transmitted_torque", "friction_torque"]), "torque");
        assert_eq!(name(&["theta"]), "rotor angle");
    }
}

mod plot_marks {
    use stickslip::plot::labels::marks;
    use stickslip::record::EventKind;

    /// Two hundred changes of the mode at the end of a long run get no lines, an isolated change gets one. Of changes
    /// with enough room, each is marked unless it coincides with another.
    #[test]
    fn analytic_crowded_events_are_left_to_the_ground() {
        let mut events = vec![
            (1.0, EventKind::Corner),
            (6.9, EventKind::Destabilised),
            (6.901, EventKind::Kick),
        ];
        let kinds = [EventKind::Stick, EventKind::Slip];
        events.extend((0..200).map(|k| (6.95 + 1e-4 * f64::from(k), kinds[k as usize % 2])));
        let whole = marks(&events, |t| 700.0 * t);
        assert_eq!(whole, [(1.0, EventKind::Corner), (6.9, EventKind::Destabilised)]);
        let close = marks(&events, |t| 2e6 * (t - 6.9));
        assert_eq!(close.len(), events.len());
    }
}

mod scale {
    use stickslip::plot::scale::{Scale, number};

    #[test]
    fn analytic_prefixes_and_offsets() {
        let z = Scale::new((-40.2e-6, 0.0), "m");
        assert_eq!((z.title("z").as_str(), z.show(-40.2e-6).round()), ("z (µm)", -40.0));
        let t = Scale::new((6.9748, 6.9768), "s");
        assert_eq!(t.title("time"), "time − 6.974 s (ms)");
        assert!((t.show(6.975) - 1.0).abs() < 1e-9);
        assert_eq!(Scale::new((-40.21e-6, -40.18e-6), "m").title("z"), "z + 40200 (nm)");
        // Too many digits in the shown unit.
        assert_eq!(
            Scale::new((345.90014, 345.90034), "rad").title("φ"),
            "φ − 345.9001 rad (µrad)"
        );
        // A corner at 1 s is drawn at 1 s, or at 0.
        assert_eq!(Scale::new((0.998, 1.009), "s").title("time"), "time (s)");
        assert_eq!(Scale::new((0.9993, 1.0004), "s").title("time"), "time − 1.00 s (µs)");
        assert_eq!(Scale::new((0.0, 100.0), "rad s-1").title("ω"), "ω (rad/s)");
        assert_eq!(Scale::new((0.0, 2224.0), "N").title("F"), "F (kN)");
        assert_eq!(Scale::new((0.0, 371.0), "rad").title("θ"), "θ (rad)");
        assert_eq!(Scale::new((0.0, 4e300), "N").title("F"), "F (10³⁰⁰ N)");
        assert_eq!(Scale::new((0.0, 2e-8), "1").title("x"), "x (10⁻⁹)");
    }

    #[test]
    fn analytic_ticks_have_the_digits_they_need() {
        let (ticks, decimals) = Scale::new((0.0, 0.6), "1").ticks(5);
        assert!(ticks.len() >= 3 && ticks.len() <= 5, "{ticks:?}");
        assert_eq!(decimals, 1);
        assert_eq!(number(-0.0, 1), "0.0");
        assert_eq!(number(-2.5, 1), "−2.5");
    }

    #[test]
    fn analytic_powers_of_ten_stand_at_whole_ticks() {
        let scale = Scale::by_powers((3e-13, 2e-3), "s");
        assert_eq!(scale.title("error"), "error (s)");
        assert!((scale.show(1e-7) + 7.0).abs() < 1e-12);
        for count in 2..10 {
            let (ticks, decimals) = scale.ticks(scale.best_count(count));
            assert!(ticks.iter().all(|t| t.fract() == 0.0), "{count}: {ticks:?}");
            assert_eq!(decimals, 0);
        }
        assert_eq!(scale.label(-7.0, 0), "10⁻⁷");
    }

    /// log10 of 2 to 9, in each power; none on a linear axis, and none where they would stand too close.
    #[test]
    fn analytic_ticks_between_powers() {
        let found = Scale::by_powers((1.0, 100.0), "1").minor_ticks();
        let expected = [0.0, 1.0]
            .into_iter()
            .flat_map(|power| (2..10).map(move |k| power + f64::from(k).log10()));
        assert_eq!(found, expected.collect::<Vec<f64>>());
        assert!(Scale::by_powers((1e-9, 1.0), "1").minor_ticks().is_empty());
        assert!(Scale::new((1.0, 100.0), "1").minor_ticks().is_empty());
    }

    #[test]
    fn analytic_a_constant_has_a_range() {
        for value in [0.0, 3.0, -1e-7, 1e-320] {
            let scale = Scale::new((value, value), "m");
            assert!(scale.shown.1 > scale.shown.0, "{value}: {scale:?}");
            assert!(scale.ticks(5).0.len() >= 2, "{value}: {scale:?} {:?}", scale.ticks(5));
        }
    }
}

mod spiral {
    use stickslip::plot::portraits::{Turns, factor_per_turn};

    /// exp(-a t) cos t loses the factor exp(-2 pi a) with each turn. With 200 samples per turn its extremes have an
    /// error of (pi/200)^2/2 = 1e-4.
    #[test]
    fn analytic_decaying_cosine() {
        for rate in [-0.05, 0.02] {
            let mut turns = Turns::default();
            for k in 0..2000 {
                let t = k as f64 * std::f64::consts::TAU / 200.0;
                turns.push((rate * t).exp() * (t + 0.3).cos());
            }
            let amplitudes = turns.amplitudes();
            assert_eq!(amplitudes.len(), 9);
            let factor = factor_per_turn(&amplitudes).unwrap();
            let expected = (rate * std::f64::consts::TAU).exp();
            assert!((factor / expected - 1.0).abs() < 2e-4, "{factor} {expected}");
        }
    }

    #[test]
    fn analytic_a_monotone_motion_has_no_turn() {
        let mut turns = Turns::default();
        (0..100).for_each(|k| turns.push(f64::from(k)));
        assert_eq!((turns.amplitudes(), factor_per_turn(&[])), (vec![], None));
    }
}

mod samples {
    use stickslip::plot::studies::rank_correlation;

    #[test]
    fn analytic_rank_correlation() {
        let x = [1.0, 2.0, 3.0, 4.0, f64::NAN];
        assert!((rank_correlation(&x, &[1.0, 10.0, 11.0, 1e9, 0.0]) - 1.0).abs() < 1e-15);
        assert!((rank_correlation(&x, &[4.0, 3.0, -2.0, -7.0, 0.0]) + 1.0).abs() < 1e-15);
        assert_eq!(rank_correlation(&x, &[1.0; 5]), 0.0);
        // 1, 2.5, 2.5, 4 against 1, 2, 3, 4.
        let ties = rank_correlation(&[1.0, 2.0, 2.0, 3.0], &[1.0, 2.0, 3.0, 4.0]);
        assert!((ties - 4.5 / (4.5f64 * 5.0).sqrt()).abs() < 1e-15, "{ties}");
    }
}

mod typeset {
    use Level::{Exponent, Index, Line};
    use stickslip::plot::text::{Level, pieces, spans};

    #[test]
    fn analytic_symbols_and_powers_are_set() {
        let set = |text: &str| pieces(text);
        let own = |list: &[(Level, &str)]| -> Vec<(Level, String)> {
            list.iter().map(|(level, text)| (*level, (*text).to_owned())).collect()
        };
        let expected = own(&[(Line, "torque T"), (Index, "f"), (Line, ", c"), (Index, "t")]);
        assert_eq!(set("torque T_f, c_t"), expected);
        assert_eq!(set("10^−5 m"), own(&[(Line, "10"), (Exponent, "−5"), (Line, " m")]));
        assert_eq!(set("10⁻¹²"), own(&[(Line, "10"), (Exponent, "−12")]));
        let expected = own(&[(Line, "|ω"), (Index, "r"), (Line, "| φ"), (Index, "1"), (Line, "′")]);
        assert_eq!(set("|ωᵣ| φ₁′"), expected);
    }

    /// Names chosen by the user are no symbols.
    #[test]
    fn analytic_names_stay_as_they_are() {
        for name in [
            "paper_si", "run_1", "a_b_c", "c_tt_", "_f", "T_", "T_fric", "x^y", "mu_s", "^2",
        ] {
            assert_eq!(pieces(name), [(Line, name.to_owned())], "{name}");
        }
    }

    #[test]
    fn analytic_spans_return_to_the_line() {
        let expected = "T<tspan dy=\"20.0\" font-size=\"72.0\">f</tspan><tspan dy=\"-20.0\" xml:space=\"preserve\"> &lt; 1 (N)</tspan>";
        assert_eq!(spans("T_f < 1 (N)", 100.0), expected);
    }
}

mod work_precision {
    use stickslip::plot::accuracy::color;

    #[test]
    fn property_methods_have_colours_of_their_own() {
        let colors: std::collections::HashSet<_> = (0..15).map(color).map(|c| (c.0, c.1, c.2)).collect();
        assert_eq!(colors.len(), 15);
    }
}

mod pdf {
    use stickslip::plot::{Drawing, DrawingElement, ElementForm};

    /// 254 x 127 mm are 720 x 360 points; the origin is at the bottom; half the opacity halves the distance from white.
    #[test]
    fn analytic_a_line_and_a_surface_have_their_places() {
        let element = |form, color, opacity, stroke| DrawingElement {
            form,
            color,
            opacity,
            stroke,
            dash: None,
        };
        let dashed = DrawingElement {
            dash: Some([30, 20]),
            ..element(ElementForm::Line([(0, 0), (2540, 0)]), [0, 0, 255], 1.0, Some(10))
        };
        let drawing = Drawing {
            name: String::new(),
            title: String::new(),
            source: String::new(),
            size: (2540, 1270),
            units_per_mm: 10.0,
            elements: vec![
                element(ElementForm::Rectangle([(0, 0), (254, 127)]), [255, 0, 0], 0.5, None),
                element(ElementForm::Line([(0, 0), (2540, 1270)]), [0, 0, 255], 1.0, Some(10)),
                dashed,
            ],
        };
        let page = String::from_utf8(drawing.page()).unwrap();
        assert_eq!(
            page,
            "1 j\n1 0.5 0.5 rg\n0 360 m\n72 360 l\n72 324 l\n0 324 l\nh\nf\n0 0 1 RG\n2.835 w\n0 360 m\n720 0 l\nS\n0 0 1 RG\n2.835 w\n[8.504 5.669] 0 d\n0 360 m\n\
             720 360 l\nS\n[] 0 d"
        );
        let pdf = drawing.pdf().unwrap();
        assert!(String::from_utf8_lossy(&pdf).contains("/MediaBox [0 0 720 360]"));
    }
}
