/* Check that the tables of a file refer only to rows that exist. */
#ifndef CT_CHECK_H
#define CT_CHECK_H

#include "file.h"

/* Fault in the tables, NULL if there is none. Fills the members' leaves. */
const char *ct_check_tables(struct ct_file *file);

#endif
