/* Check that the tables of a file refer only to rows that exist. */
#ifndef CT_CHECK_H
#define CT_CHECK_H

#include "file.h"

/* Check the tables of a file. Return the fault as text, or NULL if there is none. Also sets file->members. */
const char *ct_check_tables(struct ct_file *file);

#endif
