//! Registry of the channels of a trajectory. Files, figures, the page, exports and comparisons read it.
//!
//! A channel that is a product of two others needs an entry alone. The formula of another channel needs the equations
//! of a system: its value is in the readings of the engine, which evaluate the equations in their coordinates, and its
//! Taylor series in `Course`. Columns of single shafts and inertias depend on the case and have no entry.

use std::sync::LazyLock;

/// A channel: a quantity with a value in every row of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedChannel {
    /// Name of the column.
    pub name: &'static str,
    /// UDUNITS unit, in rotation.
    pub unit: &'static str,
    /// Description, with the paper's symbol.
    pub long_name: &'static str,
    /// Description for a case that numbers its shafts and inertias; empty if it is the same.
    pub of_trains: &'static str,
    /// Name on an axis.
    pub label: &'static str,
    /// Symbol on an axis; empty without one.
    pub symbol: &'static str,
    /// Names in other programs, in lower case, separated by blanks.
    pub aliases: &'static str,
    /// Curves on the interactive page.
    pub curves: &'static [PanelCurve],
    /// The two channels whose product it is.
    pub product: Option<[&'static str; 2]>,
    /// Whether the value depends on the motion since the start of the run.
    pub has_history: bool,
    /// Whether files of earlier versions lack the column. A reader then has the product, or NaN.
    pub optional: bool,
}

/// A curve on the interactive page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanelCurve {
    /// Form of the page: "brake" or "others"; `None` for both.
    pub of: Option<&'static str>,
    /// Title of its panel. A title without a row in the page's list of panels makes a hidden panel at the end.
    pub panel: &'static str,
    /// Place among the curves of the panel, from 0.
    pub place: u8,
    /// Legend; braces stand for the symbol.
    pub legend: &'static str,
    /// Colour of the page's style.
    pub colour: &'static str,
}

const fn both(panel: &'static str, place: u8, legend: &'static str, colour: &'static str) -> PanelCurve {
    PanelCurve {
        of: None,
        panel,
        place,
        legend,
        colour,
    }
}

const fn brake(panel: &'static str, place: u8, legend: &'static str, colour: &'static str) -> PanelCurve {
    PanelCurve {
        of: Some("brake"),
        ..both(panel, place, legend, colour)
    }
}

const fn others(panel: &'static str, place: u8, legend: &'static str, colour: &'static str) -> PanelCurve {
    PanelCurve {
        of: Some("others"),
        ..both(panel, place, legend, colour)
    }
}

const PLAIN: RecordedChannel = RecordedChannel {
    name: "",
    unit: "",
    long_name: "",
    of_trains: "",
    label: "",
    symbol: "",
    aliases: "",
    curves: &[],
    product: None,
    has_history: false,
    optional: false,
};

/// Declares a struct of channels: name, unit, description, and the other fields of [`RecordedChannel`] by name.
macro_rules! channels {
    ($(#[$doc:meta])* $name:ident {
        $($field:ident: $unit:literal, $long_name:literal $(, $key:ident: $value:expr)*;)+
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name { $(#[doc = concat!($long_name, ", ", $unit)] pub $field: f64,)+ }
        impl $name {
            /// The channels in the order of [`Self::values`].
            pub const CHANNELS: &'static [RecordedChannel] = &[$(RecordedChannel {
                name: stringify!($field),
                unit: $unit,
                long_name: $long_name,
                $($key: $value,)*
                ..PLAIN
            },)+];
            /// Number of channels.
            pub const COUNT: usize = Self::CHANNELS.len();
            /// The values in the order of `CHANNELS`.
            pub fn values(&self) -> [f64; Self::COUNT] {
                [$(self.$field,)+]
            }
            /// The inverse of [`Self::values`].
            pub fn from_values([$($field,)+]: [f64; Self::COUNT]) -> Self {
                Self { $($field,)+ }
            }
        }
    };
}

channels! {
    /// The mechanical state, stored before and after every event.
    State {
        z: "m", "axial displacement z", label: "axial displacement", symbol: "z", aliases: "axial_displacement",
            curves: &[both("Axial displacement", 0, "z", "blue")];
        z_dot: "m s-1", "axial velocity z'", label: "axial velocity", symbol: "z′", aliases: "axial_velocity dz",
            curves: &[others("Axial velocity", 0, "z′", "blue")];
        theta: "rad", "rotor angle theta", label: "rotor angle", symbol: "θ", aliases: "rotor_angle",
            curves: &[others("Angle", 2, "outermost inertia of the rotor, {}", "green")];
        theta_dot: "rad s-1", "rotor speed theta'", label: "rotor speed", symbol: "θ′",
            aliases: "omega rotor_speed dtheta",
            curves: &[
                brake("Speed", 0, "rotor", "blue"),
                others("Speed of the rotor", 0, "outermost inertia, {}", "blue"),
            ];
        phi1: "rad", "stator surface angle phi_1 (the stator twist)", label: "stator surface angle", symbol: "φ₁",
            aliases: "phi_1 stator_twist v",
            curves: &[
                brake("Twist", 1, "stator, φ₁", "vermillion"),
                others("Angle", 1, "stator surface, {}", "vermillion"),
            ];
        phi1_dot: "rad s-1", "stator surface speed phi_1'", label: "stator surface speed", symbol: "φ₁′",
            aliases: "phi_1_dot stator_twist_rate v_dot dphi1",
            curves: &[
                brake("Speed", 2, "stator surface", "green"),
                brake("Twist rate", 1, "stator", "vermillion"),
                others("Surface speed", 1, "stator, {}", "vermillion"),
            ];
        phi2: "rad", "rotor surface angle phi_2", label: "rotor surface angle", symbol: "φ₂", aliases: "phi_2",
            curves: &[others("Angle", 0, "rotor surface, {}", "blue")];
        phi2_dot: "rad s-1", "rotor surface speed phi_2'", label: "rotor surface speed", symbol: "φ₂′",
            aliases: "phi_2_dot dphi2",
            curves: &[
                brake("Speed", 1, "rotor surface", "vermillion"),
                others("Surface speed", 0, "rotor, {}", "blue"),
            ];
        rotor_twist: "rad", "rotor twist theta - phi_2", of_trains: "twist of shaft 0 of the rotor",
            label: "rotor twist", symbol: "θ − φ₂", aliases: "u twist",
            curves: &[brake("Twist", 0, "rotor, θ − φ₂", "blue")];
        rotor_twist_rate: "rad s-1", "rotor twist rate theta' - phi_2'",
            of_trains: "twist rate of shaft 0 of the rotor", label: "rotor twist rate", symbol: "θ′ − φ₂′",
            aliases: "u_dot twist_rate rotor_twist_dot", curves: &[brake("Twist rate", 0, "rotor", "blue")];
        relative_velocity: "rad s-1", "relative velocity omega_r = phi_2' - phi_1'",
            label: "relative velocity", symbol: "ωᵣ", aliases: "omega_r omega_rel w_rel w_r v_rel",
            curves: &[
                brake("Relative velocity", 0, "φ₂′ − φ₁′", "blue"),
                others("Relative velocity", 0, "{}", "blue"),
            ];
        slip_displacement: "rad", "slip displacement phi_2 - phi_1", label: "slip displacement", symbol: "φ₂ − φ₁",
            aliases: "slip_distance",
            curves: &[
                brake("Slip displacement", 0, "φ₂ − φ₁", "blue"),
                others("Slip displacement", 0, "{}", "blue"),
            ];
    }
}

channels! {
    /// Forces, torques, energies and powers at a sample.
    Channels {
        applied_force: "N", "actuating force F", label: "actuating force", symbol: "F",
            curves: &[
                brake("Axial force", 1, "applied, F", "blue"),
                others("Normal force", 1, "applied, F", "blue"),
            ];
        normal_force: "N", "contact force F_n", label: "contact force", symbol: "Fₙ",
            aliases: "f_n fn contact_force",
            curves: &[
                brake("Axial force", 0, "contact, F_n", "vermillion"),
                others("Normal force", 0, "contact, F_n", "vermillion"),
            ];
        friction_torque: "N m", "torque on the stator surface through the interface",
            label: "interface torque", symbol: "T", aliases: "t_friction",
            curves: &[both("Torque", 0, "through the interface", "blue")];
        transmitted_torque: "N m", "T_f = (T_r + T_s)/2",
            of_trains: "T_f, the torque that the interface must carry for equal surface accelerations",
            label: "transmitted torque", symbol: "T_f", aliases: "t_f",
            curves: &[
                brake("Torque", 1, "T_f = (T_r + T_s)/2", "vermillion"),
                others("Torque", 1, "to hold the surfaces together, T_f", "vermillion"),
            ];
        energy_kinetic: "J", "kinetic energy", label: "kinetic energy",
            curves: &[both("Energy", 0, "kinetic", "blue")];
        energy_elastic: "J", "elastic energy", label: "elastic energy",
            curves: &[both("Energy", 1, "elastic", "orange")];
        work_applied: "J", "work of the actuating force since the start",
            of_trains: "work of the drives, the external torques and the actuating force since the start",
            label: "work of the force", has_history: true,
            curves: &[
                brake("Energy", 4, "work of F", "purple"),
                others("Energy", 4, "work from outside", "purple"),
            ];
        work_perturbation: "J", "work of the kicks since the start", label: "work of the kicks", has_history: true,
            curves: &[others("Energy", 5, "work of kicks", "black")];
        dissipated_friction: "J", "energy dissipated by friction since the start",
            label: "energy dissipated by friction", has_history: true,
            curves: &[both("Energy", 2, "lost to friction", "vermillion")];
        dissipated_damping: "J", "energy dissipated by c_a and c_t since the start",
            of_trains: "energy dissipated by shafts, bearings and c_a since the start",
            label: "energy dissipated by damping", has_history: true,
            curves: &[both("Energy", 3, "lost to damping", "green")];
        energy_residual: "J", "kinetic + elastic + dissipated - works - initial energy",
            label: "energy residual", has_history: true,
            curves: &[both("Energy residual", 0, "made or lost by the solver", "blue")];
        contact_power: "W", "heat that friction makes in the contact per second",
            label: "contact power", symbol: "P", aliases: "friction_power p_f",
            product: Some(["friction_torque", "relative_velocity"]), optional: true,
            curves: &[both("Contact power", 0, "heat of friction", "vermillion")];
    }
}

/// Places, in a row, of each product and its two factors.
static PRODUCTS: LazyLock<Vec<(usize, [usize; 2])>> = LazyLock::new(|| {
    let place = |name: &str| {
        all()
            .position(|channel| channel.name == name)
            .expect("a factor is a channel")
    };
    let products = all().enumerate();
    let products = products.filter_map(|(k, channel)| Some((k, channel.product?.map(place))));
    products.collect()
});

impl Channels {
    /// With the channels that are products of others.
    pub fn with_products(self, state: &State) -> Channels {
        let mut row = [0.0; State::COUNT + Channels::COUNT];
        row[..State::COUNT].copy_from_slice(&state.values());
        row[State::COUNT..].copy_from_slice(&self.values());
        for &(place, [a, b]) in &*PRODUCTS {
            row[place] = product(row[a], row[b]);
        }
        Channels::from_values(std::array::from_fn(|k| row[State::COUNT + k]))
    }
}

/// Value of a channel that is a product: in stick a positive zero, whatever the sign of the torque.
fn product(a: f64, b: f64) -> f64 {
    a * b + 0.0
}

/// Values of a channel that is a product, row by row.
pub fn products(a: Vec<f64>, b: Vec<f64>) -> Vec<f64> {
    a.into_iter().zip(b).map(|(a, b)| product(a, b)).collect()
}

/// All channels, in the order of a row.
pub fn all() -> impl Iterator<Item = &'static RecordedChannel> {
    State::CHANNELS.iter().chain(Channels::CHANNELS)
}

/// The channel with this name.
pub fn find(name: &str) -> Option<&'static RecordedChannel> {
    all().find(|channel| channel.name == name)
}

/// The two factors of a channel that is a product.
pub fn factors(name: &str) -> Option<&'static [&'static str; 2]> {
    find(name)?.product.as_ref()
}
