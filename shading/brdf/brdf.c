#include "shading/brdf/brdf.h"

#include "core/text.h"

#include <math.h>
#include <string.h>

weft_err weft_brdf_find(const char *name, const weft_brdf **brdf, weft_error *err)
{
    char names[512] = "";
    size_t used = 0;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        if (strcmp((*b)->name, name) == 0) {
            *brdf = *b;
            return WEFT_OK;
        }
        const int n = snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", (*b)->name);
        used += n > 0 && used + (size_t)n < sizeof names ? (size_t)n : 0;
    }
    return weft_fail(err, WEFT_ERR_USAGE, "%s: no such BRDF; there are %s, and tables NAME.binary", name,
                     names);
}

int weft_brdf_n_planes(const weft_brdf *brdf)
{
    int n = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; p++)
        n += p->components;
    return n;
}

const weft_brdf_param *weft_brdf_find_param(const weft_brdf *brdf, const char *name, int *plane)
{
    int first = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; first += p->components, p++)
        if (strcmp(p->name, name) == 0 || (p->symbol && strcmp(p->symbol, name) == 0)) {
            if (plane)
                *plane = first;
            return p;
        }
    return NULL;
}

void weft_brdf_defaults(const weft_brdf *brdf, double values[WEFT_BRDF_MAX_PLANES])
{
    int plane = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; p++)
        for (int c = 0; c < p->components; c++)
            values[plane++] = p->def;
}

weft_err weft_brdf_check_value(const weft_brdf *brdf, const weft_brdf_param *param, double value,
                               weft_error *err)
{
    if (value >= param->min && value <= param->max)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_USAGE, "%s of %s is %g: wanted %g to %g%s%s", param->name, brdf->name,
                     value, param->min, param->max, param->unit[0] ? " " : "", param->unit);
}

static weft_err unknown_param(const weft_brdf *brdf, const char *text, size_t n, weft_error *err)
{
    char names[256] = "";
    size_t used = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; p++) {
        const int k = snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", p->name);
        used += k > 0 && used + (size_t)k < sizeof names ? (size_t)k : 0;
    }
    return weft_fail(err, WEFT_ERR_USAGE, "%.*s: %s has no such parameter; it has %s", (int)n, text,
                     brdf->name, names);
}

weft_err weft_brdf_set(const weft_brdf *brdf, const char *text, double values[WEFT_BRDF_MAX_PLANES],
                       weft_error *err)
{
    const char *const equals = strchr(text, '=');
    if (!equals)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: wanted NAME=VALUE, such as alpha=0.3", text);
    char name[64] = "";
    const size_t n = (size_t)(equals - text);
    if (n < sizeof name)
        memcpy(name, text, n);
    int plane;
    const weft_brdf_param *const param = weft_brdf_find_param(brdf, name, &plane);
    if (!param)
        return unknown_param(brdf, text, n, err);
    double numbers[3];
    int count = 0;
    for (const char *p = equals + 1; p && count < 3;) {
        p = weft_text_scan_double(p, &numbers[count]);
        if (!p || (*p != ',' && *p != '\0'))
            return weft_fail(err, WEFT_ERR_USAGE, "%s: wanted a number%s behind the '='", text,
                             param->components == 3 ? " or three with commas between" : "");
        WEFT_TRY(weft_brdf_check_value(brdf, param, numbers[count++], err));
        p = *p ? p + 1 : NULL;
        if (p && count == param->components)
            return weft_fail(err, WEFT_ERR_USAGE, "%s: too many numbers, wanted %d", text, param->components);
    }
    if (count != 1 && count != param->components)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: wanted one number or %d", text, param->components);
    for (int c = 0; c < param->components; c++)
        values[plane + c] = numbers[count == 1 ? 0 : c];
    return WEFT_OK;
}

void weft_brdf_eval_one(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                        const double light[3], const double view[3], double value[3])
{
    weft_brdf_batch batch = {.n = 1, .data = brdf->data};
    double *const out[3] = {&value[0], &value[1], &value[2]};
    for (int c = 0; c < 3; c++) {
        batch.light[c] = &light[c];
        batch.view[c] = &view[c];
    }
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
        batch.param[k] = &values[k];
    brdf->eval(&batch, out);
}

void weft_brdf_direction(double cosine, double phi_rad, double direction[3])
{
    const double sine = sqrt(fmax((1 - cosine) * (1 + cosine), 0));
    direction[0] = sine * cos(phi_rad);
    direction[1] = sine * sin(phi_rad);
    direction[2] = cosine;
}
