/* One step of the linearly implicit Euler method: (I - h f_x) (x_new - x) = h (f + h f_t). Columns of f_x without a
   common row are computed together, along their sum. Returns 0 if the matrix is singular. */
static int integrate(MODEL *m)
{
    double change[N_STATES], slopes[N_STATES], direction[N_STATES];
    double *matrix = m->matrix;
    MODEL_rates(m, change);
    remember(m);
    for (int i = 0; i < N_STATES; i++)
        direction[i] = 0.0;
    MODEL_along(m, 1.0, direction, slopes);
    for (int i = 0; i < N_STATES; i++)
        change[i] = STEP * (change[i] + STEP * slopes[i]);
    for (int i = 0; i < N_STATES * N_STATES; i++)
        matrix[i] = i % (N_STATES + 1) ? 0.0 : 1.0;
    for (int k = 0; k < N_COLOURS; k++) {
        for (int i = 0; i < N_STATES; i++)
            direction[i] = colour[i] == k;
        MODEL_along(m, 0.0, direction, slopes);
        for (int e = 0; e < N_ENTRIES; e++)
            if (colour[column_of[e]] == k)
                matrix[N_STATES * row_of[e] + column_of[e]] -= STEP * slopes[row_of[e]];
    }
    if (!eliminate(matrix, change, N_STATES))
        return 0;
    for (int i = 0; i < N_STATES; i++)
        m->x[i] += change[i];
    return 1;
}
