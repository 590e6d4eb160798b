//! Tensor-product B-spline functions in two and three dimensions: evaluation, refinement, Gram matrices, thin-plate energy
