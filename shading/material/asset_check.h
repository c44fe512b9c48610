/** Properties of one text against the table: kinds, ranges, spelling.  Used by the resolver alone. */
#ifndef WEFT_SHADING_MATERIAL_ASSET_CHECK_H
#define WEFT_SHADING_MATERIAL_ASSET_CHECK_H

#include "shading/material/material_types.h"
#include "shading/material/radattr.h"

/**
 * Checks the members of a record and brings them into the form that merging and reading know: names as the
 * table spells them, colours as records of r, g and b, numbers for lists of one.  Notes an error for a wrong
 * kind or value, a warning for an unknown property, which is kept.
 *
 * @param tables  one or two tables of rows (the second may be NULL): a layer has its own beside the
 * material's
 * @param model   the material's model: other models' properties are warned of
 * @param set_by  put on every member
 */
void weft_asset_check(weft_rad_record *record, const weft_property *const tables[2], unsigned model,
                      const char *set_by, weft_arena *arena, weft_diagnostics *diagnostics);

#endif
