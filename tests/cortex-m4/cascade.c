/* The verdict filter's cascade as everybody writes it: sections in direct form II transposed, f32.
 *
 *     y = b0 x + s1,   s1 = b1 x - a1 y + s2,   s2 = b2 x - a2 y
 *
 * What the firmware's own filter is counted beside. */
struct section { float b0, b1, b2, a1, a2, s1, s2; };

void cascade(struct section sections[2], const float *x, float *y, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        float value = x[i];
        for (int k = 0; k < 2; k++) {
            struct section *s = &sections[k];
            float out = s->b0 * value + s->s1;
            s->s1 = s->b1 * value - s->a1 * out + s->s2;
            s->s2 = s->b2 * value - s->a2 * out;
            value = out;
        }
        y[i] = value;
    }
}
