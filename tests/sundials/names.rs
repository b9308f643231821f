//! Names of flags and methods, held against the headers and the tables of SUNDIALS.

mod flags {
    use stickslip::sundials::{Flag, FlagFamily};

    fn said(family: FlagFamily, number: i32) -> String {
        Flag { family, number }.to_string()
    }

    #[test]
    fn sundials_flag_names_are_those_of_the_headers() {
        assert_eq!(said(FlagFamily::Cvode, -1), "CV_TOO_MUCH_WORK (-1)");
        assert_eq!(said(FlagFamily::Arkode, -47), "ARK_CONTROLLER_ERR (-47)");
        assert_eq!(said(FlagFamily::CvodeLinear, -9), "CVLS_SUNLS_FAIL (-9)");
        assert_eq!(said(FlagFamily::ArkodeLinear, -8), "ARKLS_JACFUNC_RECVR (-8)");
        // The numbers of modes and choices are not flags.
        assert_eq!(said(FlagFamily::Cvode, 1), "CV_TSTOP_RETURN (1)");
        assert_eq!(said(FlagFamily::Arkode, -1), "ARK_TOO_MUCH_WORK (-1)");
    }

    #[test]
    fn property_an_unknown_flag_is_a_value() {
        assert_eq!(said(FlagFamily::Cvode, -12345), "unknown flag (-12345)");
        assert!(said(FlagFamily::Core, 17).ends_with("(17)"));
    }
}

mod methods {
    use stickslip::simulation::Method;
    use stickslip::sundials::ErkTable;

    /// The C library says the orders. Every table that has an embedded method has one name.
    #[test]
    fn sundials_every_pair_has_a_name_that_tells_its_orders() {
        for &table in ErkTable::ALL {
            let methods: Vec<Method> = Method::all()
                .filter(|&method| method == Method::ErkPair(table))
                .collect();
            let [method] = methods[..] else {
                panic!("{table}: {methods:?}")
            };
            let name = method.name();
            let orders = format!("-{}{}", table.order(), table.embedded_order());
            let stages = format!("{orders}-{}s", table.stages());
            assert!(name.ends_with(&orders) || name.ends_with(&stages), "{name}: {table}");
            assert_eq!(Method::from_name(name), Some(method));
        }
    }
}
