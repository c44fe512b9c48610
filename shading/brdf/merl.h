/**
 * Measured isotropic reflectance in the MERL database's form: a table over half and difference angles.
 *
 * The half vector h of light and view stands at theta_h from the normal; in the frame that is turned to have
 * h as its pole and the plane of n and h as its azimuth 0, the light stands at theta_d, phi_d.  Light and
 * view changed places turn phi_d by pi, so phi_d counts modulo pi: a table is reciprocal by its form.
 *
 *     cell of theta_h: floor(n_h sqrt(theta_h / (pi/2)))   (small near the highlight)
 *     cell of theta_d: floor(n_d theta_d / (pi/2))         cell of phi_d: floor(n_p phi_d / pi)
 *     index = phi_d + n_p (theta_d + n_d theta_h)
 *
 * Source: Rusinkiewicz 1998, A New Change of Variables for Efficient BRDF Representation; Matusik et al.
 * 2003, A Data-Driven Reflectance Model, and the reader that comes with its data.
 */
#ifndef WEFT_SHADING_BRDF_MERL_H
#define WEFT_SHADING_BRDF_MERL_H

#include "shading/brdf/brdf.h"

#include <stdbool.h>
#include <stddef.h>

/** Cells of the database's files along theta_h, theta_d and phi_d; also what Weft writes. */
#define WEFT_MERL_THETA_H 90
#define WEFT_MERL_THETA_D 90
#define WEFT_MERL_PHI_D   180

/** Refused above these: a header that claims more is damaged. */
#define WEFT_MERL_MAX_SIDE  1024
#define WEFT_MERL_MAX_CELLS (1 << 23)

/** Stored numbers are f in 1/sr divided by these (red, green, blue). */
extern const double weft_merl_scale[3];

typedef struct weft_merl {
    int size[3];      /* cells along theta_h, theta_d, phi_d */
    double *value[3]; /* [colour][theta_h][theta_d][phi_d], f in 1/sr; below 0: no measurement */
    char *name;
    weft_brdf brdf; /* the table as a model; its data is this struct, which must stay where it is */
} weft_merl;

static inline size_t weft_merl_cells(const int size[3])
{
    return (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
}

/** Light and view of a place in the table, given by its angles; the half vector lies over +X. */
void weft_merl_directions(double theta_h, double theta_d, double phi_d, double light[3], double view[3]);

/** The angles of a pair of directions; phi_d in [0, pi).  Where h = n the plane of n and h is that of X.
 *  l = -v gives theta_h 0 and theta_d pi/2. */
void weft_merl_angles(const double light[3], const double view[3], double *theta_h, double *theta_d,
                      double *phi_d);

/**
 * Reads a table, of any size up to the limits.  weft_merl_destroy() it.
 *
 * merl->brdf is a model without parameters: values between the middles of cells are linear in the cells'
 * coordinates (theta_h by its root), over those that have a measurement; with none around it is 0.
 *
 * @return WEFT_ERR_FORMAT for a file that is cut off or too long, sizes that cannot be, NaN or infinity (with
 *         the cell), or no measurement at all; WEFT_ERR_IO, WEFT_ERR_NOMEM
 */
weft_err weft_merl_read(const char *path, weft_merl **merl, weft_error *err);

/** A table of `size` cells, all marked as not measured, to fill and save.  weft_merl_destroy() it. */
weft_err weft_merl_create(const int size[3], const char *name, weft_merl **merl, weft_error *err);

/** Writes a table as it is; what is below 0 as -1.  @return WEFT_ERR_IO, WEFT_ERR_NOMEM */
weft_err weft_merl_save(const char *path, const weft_merl *merl, weft_error *err);

/**
 * Light and view that stand for a cell: its middle, or where that lies below the horizon the first place
 * above it on the way to the cell's highest corner (the smallest angles, phi_d next to 90 degrees).
 *
 * @param cell  along theta_h, theta_d, phi_d
 * @return false where all of the cell is below
 */
bool weft_merl_cell(const int size[3], const int cell[3], double light[3], double view[3]);

/** Frees it; NULL is fine. */
void weft_merl_destroy(weft_merl *merl);

/**
 * Writes a model at the middle of each cell as a file of the database's size.  A cell that the horizon of
 * light or view cuts has the value at a place above it; one wholly below is -1.
 *
 * @return WEFT_ERR_USAGE for a model whose value turns with the azimuth at these parameters: the table has no
 *         place for it; WEFT_ERR_IO
 */
weft_err weft_merl_write(const char *path, const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                         weft_error *err);

/** The model of a name as weft_brdf_find(), or of a file NAME.binary; `*loaded` is then the table to destroy,
 *  else NULL. */
weft_err weft_brdf_open(const char *name, weft_merl **loaded, const weft_brdf **brdf, weft_error *err);

#endif
