//! The ground of numbers: statistics, least squares, robust fits. No body, no pose, no file.

mod correlated;
mod distribution;
mod dual;
mod levenberg_marquardt;
mod linear;
mod pieces;
mod profile;
mod random_effects;
mod robust;
mod rotation;
mod smoothing;
mod spectrum;
mod turning;

pub use correlated::{
    MeanEstimate, autocorrelation, batch_means_sd, block_bootstrap_sd, correlated_mean, effective_samples, ljung_box,
};
pub use distribution::{chi_squared_quantile, chi_squared_tail, mixture_quantile, normal_quantile, t_quantile, t_tail};
pub use dual::{Dual, Real};
pub use levenberg_marquardt::{Fit, Loss, Settings, levenberg_marquardt, levenberg_marquardt_exact};
pub use linear::{LinearFit, bayesian_linear, robust_linear, weighted_linear};
pub use pieces::{Freed, freed, noise_of};
pub use profile::profile_ends;
pub use random_effects::{Marginal, Pooled, normalised, random_effects, random_effects_marginal, scatters};
pub use robust::{mad_sd, median, quantile, trimmed_mean};
pub use rotation::{mean_rotation, rotation_centre};
pub use smoothing::{LocalFit, interpolate, local_quadratic};
pub use spectrum::{CommonLine, Grid, Spectrum};
pub use turning::{Turned, turned_displacement};
