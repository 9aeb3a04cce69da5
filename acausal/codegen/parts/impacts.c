#define ROUNDING_OF_IMPULSES 1e-11 /* violation of an inequality, relative to its terms, that counts as zero */

/* Solves the equations of the active set: offset + matrix x = 0 for the active elements, and x = 0 for all others. The
   matrix has a unit diagonal. Returns 0 if there is no solution. */
static int solve_active(const double *matrix, const double *offset, const int *active, double *x)
{
    double own[N_IMPACTS * N_IMPACTS];
    for (int i = 0; i < N_IMPACTS; i++) {
        for (int j = 0; j < N_IMPACTS; j++)
            own[N_IMPACTS * i + j] = active[i] && active[j] ? matrix[N_IMPACTS * i + j] : i == j;
        x[i] = active[i] ? -offset[i] : 0.0;
    }
    return eliminate(own, x, N_IMPACTS);
}

/* Solves the linear complementarity problem x >= 0, u = offset + matrix x >= 0, x u = 0, by the active-set method of
   Lawson and Hanson. `size` holds the sizes of the terms of the offset. Returns 0 if there is no solution. */
static int solve_complementarity(const double *matrix, const double *offset, const double *size, double *x)
{
    int active[N_IMPACTS] = {0}, is_solved = 1;
    for (int i = 0; i < N_IMPACTS; i++)
        x[i] = 0.0;
    for (int count = 0; count < 10 + 8 * N_IMPACTS; count++) {
        if (is_solved) {
            double worst = 0.0;
            int enters = -1;
            for (int i = 0; i < N_IMPACTS; i++) {
                double violation = -offset[i] - ROUNDING_OF_IMPULSES * size[i];
                for (int j = 0; j < N_IMPACTS; j++) {
                    const double term = matrix[N_IMPACTS * i + j] * x[j];
                    violation -= term + ROUNDING_OF_IMPULSES * fabs(term);
                }
                if (!active[i] && violation > worst) {
                    worst = violation;
                    enters = i;
                }
            }
            if (enters < 0)
                return 1;
            active[enters] = 1;
        }
        double aim[N_IMPACTS], share = 1.0;
        if (!solve_active(matrix, offset, active, aim))
            return 0;
        is_solved = 1;
        for (int i = 0; i < N_IMPACTS; i++)
            if (active[i] && aim[i] <= 0.0) {
                share = fmin(share, x[i] / (x[i] - aim[i]));
                is_solved = 0;
            }
        /* The step towards the solution ends where the first element becomes zero, which leaves the active set. */
        for (int i = 0; i < N_IMPACTS; i++) {
            const int leaves = active[i] && aim[i] <= 0.0 && x[i] / (x[i] - aim[i]) <= share;
            x[i] = leaves ? 0.0 : x[i] + share * (aim[i] - x[i]);
            active[i] = active[i] && !leaves;
        }
    }
    return 0;
}

/* The rates of the states and of the separation speeds with a force of 1 at the contact `pushed`; without any force if
   it is -1. */
static void evaluate_pushed(MODEL *m, int pushed, double *states, double *speeds)
{
    for (int i = 0; i < N_IMPACTS; i++)
        m->d[force_of_impact[i]] = i == pushed;
    MODEL_evaluate(m);
    contact_rates(m, speeds);
    for (int i = 0; i < N_STATES; i++)
        states[i] = m->v[rate_of_state[i]];
}

/* Executes events. If impacts are among them, all states also change by the change of their rates with the contact
   forces, times the impulses. The rates are those with closed contacts open and stuck friction free. */
static int act(MODEL *m, const int *fired)
{
    double closed[N_IMPACTS], speed[N_IMPACTS], after[N_IMPACTS], rates[N_STATES], speeds[N_IMPACTS];
    double pushed[N_STATES], answer[N_IMPACTS * N_STATES], matrix[N_IMPACTS * N_IMPACTS], d[N_DISCRETE], p[N_IMPACTS];
    double offset[N_IMPACTS], size[N_IMPACTS], scale[N_IMPACTS], change[N_IMPACTS];
    int is_any = 0;
    for (int i = 0; i < N_IMPACTS; i++)
        is_any = is_any || fired[event_of_impact[i]];
    if (!is_any)
        return set_new_values(m, fired);
    contact_speeds(m, closed, speed, after);
    for (int i = 0; i < N_DISCRETE; i++)
        d[i] = m->d[i];
    set_new_values(m, is_yields);
    evaluate_pushed(m, -1, rates, speeds);
    for (int j = 0; j < N_IMPACTS; j++) {
        evaluate_pushed(m, j, pushed, change);
        for (int i = 0; i < N_IMPACTS; i++)
            matrix[N_IMPACTS * i + j] = change[i] - speeds[i];
        for (int i = 0; i < N_STATES; i++)
            answer[N_STATES * j + i] = pushed[i] - rates[i];
    }
    for (int i = 0; i < N_DISCRETE; i++)
        m->d[i] = d[i];
    MODEL_evaluate(m);
    for (int i = 0; i < N_IMPACTS; i++) {
        const int is_struck = fired[event_of_impact[i]], gives_way = matrix[(N_IMPACTS + 1) * i] > 0.0;
        if (is_struck && !gives_way)
            return 0; /* No force opens the contact, such as one between two given motions. */
        const int takes_part = (is_struck || closed[i] > 0.5) && gives_way;
        scale[i] = takes_part ? 1.0 / sqrt(matrix[(N_IMPACTS + 1) * i]) : 0.0;
        offset[i] = scale[i] * (speed[i] - after[i]);
        size[i] = scale[i] * (fabs(speed[i]) + fabs(after[i]));
    }
    for (int i = 0; i < N_IMPACTS; i++)
        for (int j = 0; j < N_IMPACTS; j++)
            matrix[N_IMPACTS * i + j] *= scale[i] * scale[j];
    if (!solve_complementarity(matrix, offset, size, p) || !set_new_values(m, fired))
        return 0;
    for (int j = 0; j < N_IMPACTS; j++)
        for (int i = 0; i < N_STATES; i++)
            m->x[i] += answer[N_STATES * j + i] * scale[j] * p[j];
    return 1;
}
