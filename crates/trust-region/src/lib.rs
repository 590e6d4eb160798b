//! Trust-region minimisation of Sampson error plus thin-plate energy over B-spline coefficients
