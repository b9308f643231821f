//! How a run is integrated and what it writes.

/// The integration method of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The combination chosen by measurement: see [`crate::simulation`].
    Auto,
    /// CVODE BDF for everything.
    CvodeBdf,
    /// CVODE Adams for everything.
    CvodeAdams,
    /// ARKODE's explicit Runge-Kutta method for everything.
    Erk,
    /// ARKODE's singly diagonally implicit Runge-Kutta method for everything.
    Esdirk,
    /// Radau collocation while sliding, Taylor series where the fast mode is followed, closed forms in stick and
    /// separation: no solver of SUNDIALS.
    Series,
}

impl Method {
    pub const ALL: [Method; 6] = [
        Method::Auto,
        Method::CvodeBdf,
        Method::CvodeAdams,
        Method::Erk,
        Method::Esdirk,
        Method::Series,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Method::Auto => "auto",
            Method::CvodeBdf => "cvode-bdf",
            Method::CvodeAdams => "cvode-adams",
            Method::Erk => "erk",
            Method::Esdirk => "esdirk",
            Method::Series => "series",
        }
    }

    pub fn from_name(name: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|m| m.name() == name)
    }
}

/// Solver settings; `None` means the default that the simulation derives from the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SolverOptions {
    pub method: Method,
    /// Relative tolerance; smaller is more accurate in every phase.
    pub rtol: f64,
    /// Absolute tolerance of the twists, rad.
    pub atol_twist: Option<f64>,
    /// Absolute tolerance of the twist rates, rad/s.
    pub atol_rate: Option<f64>,
    /// Absolute tolerance of the relative velocity, rad/s.
    pub atol_speed: Option<f64>,
    /// Upper bound of every step, s.
    pub max_step: Option<f64>,
    /// Most transitions of a run before it is ended with an error.
    pub max_events: usize,
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            method: Method::Auto,
            rtol: 1e-10,
            atol_twist: None,
            atol_rate: None,
            atol_speed: None,
            max_step: None,
            max_events: 100_000,
        }
    }
}

/// What is sampled, and until when the run goes.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputOptions {
    /// s.
    pub end_time: f64,
    /// Sampling interval outside every window, s.
    pub interval: f64,
    pub windows: Vec<OutputWindow>,
    /// Also record a sample at every step of the integrator.
    pub steps: bool,
}

/// A stretch of time sampled more densely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputWindow {
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// s.
    pub interval: f64,
}
