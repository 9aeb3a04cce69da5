/* The residuals of a block for its scaled unknowns x, and their derivatives with respect to x, row by row. */
typedef void (*Equations)(const double *in, const double *x, double *residual, double *slopes);
