/* Whether the tables of a file lead to nothing that is not there. */
#ifndef CT_CHECK_H
#define CT_CHECK_H

#include "file.h"

/* What is wrong with the tables, NULL where nothing is. Fills the members' leaves. */
const char *ct_check_tables(struct ct_file *file);

#endif
