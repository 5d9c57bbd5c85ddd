/* Reading from servers, where it was left out of the build. */
#include "dataset/remote_link.h"

int spl_remote_link_open(const struct spl_remote_url *url, const struct spl_s3_account *account, const char *landed,
                         struct spl_remote_link *out, struct spl_error *err)
{
    (void)account;
    (void)landed;
    *out = (struct spl_remote_link){0};
    return spl_fail(err, SPL_E_UNSUPPORTED,
                    "cannot read %s: this splatd was built without servers (-Dremote=disabled); copy the dataset here",
                    url->shown);
}
