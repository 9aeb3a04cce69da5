/* One step of STEP seconds; then the events at its end. Returns 1 if an event has changed the model, 0 if not, and -1
   if the step or the events fail. */
int MODEL_step(MODEL *m)
{
    if (!integrate(m))
        return -1;
    m->count++;
    m->t = m->start + m->count * STEP;
    return MODEL_events(m);
}
