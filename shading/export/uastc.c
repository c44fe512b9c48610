#include "shading/export/uastc.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_COMPONENTS = 4, MAX_LEVELS = 256, REFINEMENTS = 2, NO_BIAS = 13 };

/* A mode: its code, which hints it has, and how weights and endpoints are quantised. */
typedef struct mode {
    int index, code, code_bits;
    int components, weight_bits;
    bool dual, has_hint1, has_bias;
    int bits, trits, quints; /* of an endpoint value: (trit or quint) << bits | bits */
} mode;

static const mode modes[] = {
    {0, 0x1, 4, 3, 4, false, true, true, 6, 1, 0},    {5, 0xB, 5, 3, 3, false, true, true, 8, 0, 0},
    {18, 0x9, 4, 3, 5, false, true, true, 5, 0, 0},   {6, 0x1B, 5, 3, 2, true, true, true, 5, 0, 1},
    {10, 0x2, 3, 4, 4, false, false, false, 4, 1, 0}, {12, 0x6, 3, 4, 3, false, false, false, 6, 1, 0},
    {11, 0x0, 2, 4, 2, true, false, false, 4, 1, 0},
};

enum { N_MODES = sizeof modes / sizeof modes[0], SOLID_CODE = 0x17, SOLID_BITS = 5 };

/* Endpoints and weights of a block under a mode. */
typedef struct fit {
    const mode *mode;
    int selector;            /* the component of the second plane, or -1 */
    uint8_t low[4], high[4]; /* codes */
    uint8_t weights[2][16];
    double error;
} fit;

/* -- numbers ------------------------------------------------------------------------------------------ */

static int levels_of(const mode *m)
{
    return (m->trits ? 3 : m->quints ? 5 : 1) << m->bits;
}

/* ASTC 18.13, endpoint unquantization: a code to 0..255. */
static int unquantise(const mode *m, int code)
{
    const int bits = code & ((1 << m->bits) - 1), d = code >> m->bits;
    if (!m->trits && !m->quints) {
        int value = bits << (8 - m->bits);
        for (int have = m->bits; have < 8; have *= 2)
            value |= value >> have;
        return value & 255;
    }
    const int a = bits & 1 ? 0x1ff : 0, x = bits >> 1;
    int b, c;
    if (m->trits && m->bits == 4) { /* dcba: B = dcb000dcb */
        b = x << 6 | x;
        c = 22;
    } else if (m->trits) { /* fedcba: B = fedcb000f */
        b = x << 4 | x >> 4;
        c = 5;
    } else { /* edcba, quints: B = edcb0000e */
        b = x << 5 | x >> 3;
        c = 6;
    }
    const int t = (d * c + b) ^ a;
    return (a & 0x80) | t >> 2;
}

/* ASTC 18.14, weight unquantization: codes of `bits` to 0..64. */
static int unquantise_weight(int code, int bits)
{
    int value = code << (6 - bits);
    for (int have = bits; have < 6; have *= 2)
        value |= value >> have;
    value &= 63;
    return value > 32 ? value + 1 : value;
}

/* What every block needs, made once for a thread. */
typedef struct tables {
    bool ready;
    uint8_t value[N_MODES][MAX_LEVELS];
    uint8_t nearest[N_MODES][256];
    float weight[6][32]; /* by bits, 0..1 */
} tables;

static const tables *the_tables(void)
{
    static _Thread_local tables t;
    if (t.ready)
        return &t;
    for (int k = 0; k < N_MODES; k++) {
        const int n = levels_of(&modes[k]);
        for (int code = 0; code < n; code++)
            t.value[k][code] = (uint8_t)unquantise(&modes[k], code);
        for (int v = 0; v < 256; v++) {
            int best = 0;
            for (int code = 1; code < n; code++)
                if (abs(t.value[k][code] - v) < abs(t.value[k][best] - v))
                    best = code;
            t.nearest[k][v] = (uint8_t)best;
        }
    }
    for (int bits = 2; bits <= 5; bits++)
        for (int code = 0; code < 1 << bits; code++)
            t.weight[bits][code] = (float)unquantise_weight(code, bits) / 64;
    t.ready = true;
    return &t;
}

/* -- fitting ------------------------------------------------------------------------------------------ */

/* The components that one plane of weights moves. */
typedef struct plane {
    int n, component[MAX_COMPONENTS];
} plane;

static float clamp255(float v)
{
    return v < 0 ? 0 : v > 255 ? 255 : v;
}

/* Both ends of the texels along their main axis. */
static void span(const float texels[16][4], const plane *p, float low[4], float high[4])
{
    float mean[4] = {0}, covariance[4][4] = {{0}}, axis[4] = {1, 1, 1, 1}, least = 1e9F, most = -1e9F;
    for (int k = 0; k < p->n; k++) {
        for (int i = 0; i < 16; i++)
            mean[k] += texels[i][p->component[k]];
        mean[k] /= 16;
    }
    for (int i = 0; i < 16; i++)
        for (int j = 0; j < p->n; j++)
            for (int k = 0; k < p->n; k++)
                covariance[j][k] +=
                    (texels[i][p->component[j]] - mean[j]) * (texels[i][p->component[k]] - mean[k]);
    for (int k = 0; k < p->n; k++) /* the widest component to begin with: never at right angles to the axis */
        axis[k] = covariance[k][k];
    for (int round = 0; round < 8; round++) {
        float next[4] = {0}, length = 0;
        for (int j = 0; j < p->n; j++) {
            for (int k = 0; k < p->n; k++)
                next[j] += covariance[j][k] * axis[k];
            length += next[j] * next[j];
        }
        if (length < 1e-12F)
            break;
        length = 1 / sqrtf(length);
        for (int k = 0; k < p->n; k++)
            axis[k] = next[k] * length;
    }
    for (int i = 0; i < 16; i++) {
        float t = 0;
        for (int k = 0; k < p->n; k++)
            t += (texels[i][p->component[k]] - mean[k]) * axis[k];
        least = fminf(least, t);
        most = fmaxf(most, t);
    }
    for (int k = 0; k < p->n; k++) {
        low[k] = clamp255(mean[k] + least * axis[k]);
        high[k] = clamp255(mean[k] + most * axis[k]);
    }
}

/* The nearest weights for the quantised ends; the sum of squares that is left. */
static float weigh(const float texels[16][4], const plane *p, const float low[4], const float high[4],
                   const float *steps, int n_steps, uint8_t weights[16])
{
    float d[4], length = 0, error = 0;
    for (int k = 0; k < p->n; k++) {
        d[k] = high[k] - low[k];
        length += d[k] * d[k];
    }
    const float scale = length > 0 ? (float)(n_steps - 1) / length : 0;
    for (int i = 0; i < 16; i++) {
        float t = 0;
        for (int k = 0; k < p->n; k++)
            t += (texels[i][p->component[k]] - low[k]) * d[k];
        const float at = t * scale;
        const int code = at <= 0 ? 0 : at >= (float)(n_steps - 1) ? n_steps - 1 : (int)(at + 0.5F);
        weights[i] = (uint8_t)code;
        for (int k = 0; k < p->n; k++) {
            const float left = low[k] + steps[code] * d[k] - texels[i][p->component[k]];
            error += left * left;
        }
    }
    return error;
}

/* The ends that are best for the weights there are; false where all weights are alike. */
static bool refine(const float texels[16][4], const plane *p, const float *steps, const uint8_t weights[16],
                   float low[4], float high[4])
{
    float a = 0, b = 0, c = 0, x[4] = {0}, y[4] = {0};
    for (int i = 0; i < 16; i++) {
        const float w = steps[weights[i]], v = 1 - w;
        a += v * v;
        b += v * w;
        c += w * w;
        for (int k = 0; k < p->n; k++) {
            x[k] += v * texels[i][p->component[k]];
            y[k] += w * texels[i][p->component[k]];
        }
    }
    const float determinant = a * c - b * b;
    if (determinant < 1e-4F)
        return false;
    for (int k = 0; k < p->n; k++) {
        low[k] = clamp255((c * x[k] - b * y[k]) / determinant);
        high[k] = clamp255((a * y[k] - b * x[k]) / determinant);
    }
    return true;
}

static void fit_plane(const tables *t, int which, const float texels[16][4], const plane *p, fit *f,
                      uint8_t weights[16])
{
    const mode *const m = &modes[which];
    const float *const steps = t->weight[m->weight_bits];
    float low[4], high[4], best = 1e30F;
    span(texels, p, low, high);
    for (int round = 0; round <= REFINEMENTS; round++) {
        uint8_t codes[2][4], now[16];
        float ends[2][4];
        for (int k = 0; k < p->n; k++) {
            codes[0][k] = t->nearest[which][(int)(low[k] + 0.5F)];
            codes[1][k] = t->nearest[which][(int)(high[k] + 0.5F)];
            for (int e = 0; e < 2; e++)
                ends[e][k] = (float)t->value[which][codes[e][k]];
        }
        const float error = weigh(texels, p, ends[0], ends[1], steps, 1 << m->weight_bits, now);
        if (error < best) {
            best = error;
            memcpy(weights, now, 16);
            for (int k = 0; k < p->n; k++) {
                f->low[p->component[k]] = codes[0][k];
                f->high[p->component[k]] = codes[1][k];
            }
        }
        if (best < 1 || !refine(texels, p, steps, now, low, high))
            break;
    }
    f->error += (double)best;
}

static fit fit_mode(const tables *t, int which, int selector, const float texels[16][4])
{
    fit f = {.mode = &modes[which], .selector = selector};
    plane first = {0}, second = {1, {selector}};
    for (int c = 0; c < modes[which].components; c++)
        if (c != selector)
            first.component[first.n++] = c;
    fit_plane(t, which, texels, &first, &f, f.weights[0]);
    if (selector >= 0)
        fit_plane(t, which, texels, &second, &f, f.weights[1]);
    return f;
}

static fit best_fit(const float texels[16][4], bool has_alpha)
{
    const tables *const t = the_tables();
    fit best = {.error = 1e30};
    for (int k = 0; k < N_MODES; k++) {
        if ((modes[k].components == 4) != has_alpha)
            continue;
        for (int s = modes[k].dual ? 0 : -1; s < (modes[k].dual ? modes[k].components : 0); s++) {
            const fit f = fit_mode(t, k, s, texels);
            if (f.error < best.error)
                best = f;
        }
        if (best.error < 8) /* half a code a texel: as good as 8 bits get */
            break;
    }
    return best;
}

/* -- hints for ETC ------------------------------------------------------------------------------------ */

static float luma(const float texel[4])
{
    return 0.3F * texel[0] + 0.6F * texel[1] + 0.1F * texel[2];
}

/* The table of ETC1 whose outer step is nearest to how far the half strays from its mean. */
static int etc1_table(const float texels[16][4], const int part[8], float *spread)
{
    static const int outer[8] = {8, 17, 29, 42, 60, 80, 106, 183};
    float mean = 0, most = 0;
    for (int i = 0; i < 8; i++)
        mean += luma(texels[part[i]]) / 8;
    for (int i = 0; i < 8; i++) {
        const float d = fabsf(luma(texels[part[i]]) - mean);
        most = fmaxf(most, d);
        *spread += d * d;
    }
    int best = 0;
    for (int k = 1; k < 8; k++)
        if (fabsf((float)outer[k] - most) < fabsf((float)outer[best] - most))
            best = k;
    return best;
}

typedef struct etc1_hint {
    int flip, table[2];
} etc1_hint;

/* Halves beside or above each other, whichever are the more even. */
static etc1_hint hint_etc1(const float texels[16][4])
{
    etc1_hint hints[2];
    float spread[2] = {0, 0};
    for (int flip = 0; flip < 2; flip++) {
        hints[flip].flip = flip;
        for (int half = 0; half < 2; half++) {
            int part[8], n = 0;
            for (int i = 0; i < 16; i++)
                if ((flip ? i / 8 : i % 4 / 2) == half)
                    part[n++] = i;
            hints[flip].table[half] = etc1_table(texels, part, &spread[flip]);
        }
    }
    return hints[spread[1] < spread[0]];
}

/* Table 0 of EAC reaches from -15 to 14. */
static int hint_eac(const float texels[16][4])
{
    float least = 255, most = 0;
    for (int i = 0; i < 16; i++) {
        least = fminf(least, texels[i][3]);
        most = fmaxf(most, texels[i][3]);
    }
    const int multiplier = (int)((most - least) / 29 + 0.5F);
    return (multiplier < 1 ? 1 : multiplier > 15 ? 15 : multiplier) << 4;
}

/* -- bits --------------------------------------------------------------------------------------------- */

typedef struct writer {
    uint8_t *block;
    int at;
} writer;

/* The lowest bit first. */
static void put(writer *w, unsigned value, int bits)
{
    for (int k = 0; k < bits; k++, w->at++)
        if (value >> k & 1)
            w->block[w->at / 8] = (uint8_t)(w->block[w->at / 8] | 1u << (w->at & 7));
}

static unsigned get(const uint8_t block[16], int *at, int bits)
{
    unsigned value = 0;
    for (int k = 0; k < bits; k++, ++*at)
        value |= ((unsigned)block[*at / 8] >> (*at & 7) & 1u) << k;
    return value;
}

/* Trits in fives, quints in threes; a rest takes as few bits as it can. */
static int rest_bits(const mode *m, int n)
{
    static const int trits[] = {0, 2, 4, 5, 7, 8}, quints[] = {0, 3, 5, 7};
    return m->trits ? trits[n] : quints[n];
}

static void put_endpoints(writer *w, const mode *m, const uint8_t *codes, int n)
{
    const int base = m->trits ? 3 : 5, group = m->trits ? 5 : 3;
    for (int i = 0; i < n && (m->trits || m->quints); i += group) {
        unsigned packed = 0;
        const int count = n - i < group ? n - i : group;
        for (int k = count - 1; k >= 0; k--)
            packed = packed * (unsigned)base + (unsigned)(codes[i + k] >> m->bits);
        put(w, packed, rest_bits(m, count));
    }
    for (int i = 0; i < n; i++)
        put(w, codes[i] & ((1u << m->bits) - 1), m->bits);
}

/* The first weight of a plane has no highest bit: ends are swapped where it would have one. */
static void anchor(fit *f, int which)
{
    const int top = (1 << f->mode->weight_bits) - 1;
    if (!(f->weights[which][0] >> (f->mode->weight_bits - 1)))
        return;
    for (int i = 0; i < 16; i++)
        f->weights[which][i] = (uint8_t)(top - f->weights[which][i]);
    for (int c = 0; c < f->mode->components; c++)
        if ((c == f->selector) == (which == 1)) {
            const uint8_t low = f->low[c];
            f->low[c] = f->high[c];
            f->high[c] = low;
        }
}

static void write_fit(fit *f, const float texels[16][4], uint8_t block[16])
{
    const mode *const m = f->mode;
    const etc1_hint hint = hint_etc1(texels);
    writer w = {block, 0};
    uint8_t codes[8] = {0};
    memset(block, 0, 16);
    anchor(f, 0);
    if (m->dual)
        anchor(f, 1);
    put(&w, (unsigned)m->code, m->code_bits);
    put(&w, 0, m->has_hint1 ? 2 : 1); /* BC1 is fitted from the texels */
    put(&w, (unsigned)hint.flip, 1);
    put(&w, 0, 1); /* both halves in full: ETC1's differences could not reach */
    put(&w, (unsigned)hint.table[0], 3);
    put(&w, (unsigned)hint.table[1], 3);
    if (m->has_bias)
        put(&w, NO_BIAS, 5);
    if (m->components == 4)
        put(&w, (unsigned)hint_eac(texels), 8);
    if (m->dual)
        put(&w, (unsigned)f->selector, 2);
    for (int c = 0; c < m->components; c++) {
        codes[2 * (size_t)c] = f->low[c];
        codes[2 * (size_t)c + 1] = f->high[c];
    }
    put_endpoints(&w, m, codes, 2 * m->components);
    for (int i = 0; i < 16; i++)
        for (int k = 0; k <= m->dual; k++)
            put(&w, f->weights[k][i], m->weight_bits - (i == 0));
}

static void write_solid(const uint8_t texel[4], uint8_t block[16])
{
    writer w = {block, 0};
    memset(block, 0, 16);
    put(&w, SOLID_CODE, SOLID_BITS);
    for (int c = 0; c < 4; c++)
        put(&w, texel[c], 8);
    put(&w, 1, 1); /* ETC1: five bits a colour, the finest table, its step of +2 */
    put(&w, 0, 3);
    put(&w, 2, 2);
    for (int c = 0; c < 3; c++) {
        const int low = texel[c] > 2 ? texel[c] - 2 : 0;
        put(&w, (unsigned)((low * 31 + 127) / 255), 5);
    }
}

void weft_uastc_encode(const uint8_t texels[16][4], bool has_alpha, uint8_t block[16])
{
    float exact[16][4];
    uint8_t first[4];
    bool is_solid = true;
    memcpy(first, texels[0], 4);
    if (!has_alpha)
        first[3] = 255;
    for (int i = 0; i < 16; i++) {
        is_solid = is_solid && memcmp(texels[i], texels[0], has_alpha ? 4 : 3) == 0;
        for (int c = 0; c < 4; c++)
            exact[i][c] = (float)texels[i][c];
    }
    if (is_solid) {
        write_solid(first, block);
        return;
    }
    fit f = best_fit((const float(*)[4])exact, has_alpha);
    write_fit(&f, (const float(*)[4])exact, block);
}

/* -- decoding ----------------------------------------------------------------------------------------- */

static void get_endpoints(const uint8_t block[16], int *at, const mode *m, uint8_t *codes, int n)
{
    const unsigned base = m->trits ? 3 : 5;
    const int group = m->trits ? 5 : 3;
    for (int i = 0; i < n && (m->trits || m->quints); i += group) {
        const int count = n - i < group ? n - i : group;
        unsigned packed = get(block, at, rest_bits(m, count));
        for (int k = 0; k < count; k++, packed /= base)
            codes[i + k] = (uint8_t)(packed % base << m->bits);
    }
    for (int i = 0; i < n; i++)
        codes[i] = (uint8_t)(codes[i] | get(block, at, m->bits));
}

static void decode_mode(const mode *m, const uint8_t block[16], uint8_t texels[16][4])
{
    uint8_t codes[8] = {0};
    int at = m->code_bits + (m->has_hint1 ? 2 : 1) + 8 + (m->has_bias ? 5 : 0) + (m->components == 4 ? 8 : 0);
    const int selector = m->dual ? (int)get(block, &at, 2) : -1;
    get_endpoints(block, &at, m, codes, 2 * m->components);
    for (int i = 0; i < 16; i++) {
        int weights[2] = {0, 0};
        for (int k = 0; k <= m->dual; k++)
            weights[k] = unquantise_weight((int)get(block, &at, m->weight_bits - (i == 0)), m->weight_bits);
        texels[i][3] = 255;
        for (int c = 0; c < m->components; c++) {
            const int low = unquantise(m, codes[2 * (size_t)c]) * 257,
                      high = unquantise(m, codes[2 * (size_t)c + 1]) * 257;
            const int w = weights[c == selector];
            texels[i][c] = (uint8_t)((low * (64 - w) + high * w + 32) >> 6 >> 8);
        }
    }
}

bool weft_uastc_decode(const uint8_t block[16], uint8_t texels[16][4])
{
    for (int k = 0; k < N_MODES; k++)
        if ((block[0] & ((1 << modes[k].code_bits) - 1)) == modes[k].code) {
            decode_mode(&modes[k], block, texels);
            return true;
        }
    if ((block[0] & ((1 << SOLID_BITS) - 1)) != SOLID_CODE)
        return false;
    for (int i = 0; i < 16; i++) {
        int at = SOLID_BITS;
        for (int c = 0; c < 4; c++)
            texels[i][c] = (uint8_t)get(block, &at, 8);
    }
    return true;
}
