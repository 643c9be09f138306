//! The ground of numbers: statistics, least squares, robust fits. No body, no pose, no file.
