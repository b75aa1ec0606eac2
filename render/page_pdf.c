#include "render/page_pdf.h"

#include "base/base.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

// True if a signal to stop is pending; it is delivered after the folder has been removed.
static bool is_stopped(void)
{
    sigset_t pending;
    return sigpending(&pending) == 0 && (sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGHUP) == 1);
}

// Waits for the browser and its children, which form their own process group; kills the group if this process is stopped.
static bool has_succeeded(pid_t child)
{
    int status = -1;
    pid_t ended;
    while ((ended = waitpid(child, &status, WNOHANG)) == 0) {
        if (is_stopped())
            kill(-child, SIGKILL);
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    return ended == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// Runs a browser without a shell and discards its messages. Returns false if it cannot be run or fails.
static bool browser_prints(const char *browser, const char *html, const char *pdf, const sigset_t *signals)
{
    char print[4200], url[4200], profile[4200];
    snprintf(print, sizeof print, "--print-to-pdf=%s", pdf);
    snprintf(url, sizeof url, "file://%s", html);
    snprintf(profile, sizeof profile, "--user-data-dir=%s.profile", html);
    const char *argument[] = {browser,
                              "--headless",
                              "--disable-gpu",
                              "--no-pdf-header-footer",
                              "--print-to-pdf-no-header",
                              profile,
                              print,
                              geteuid() == 0 ? "--no-sandbox" : url,
                              geteuid() == 0 ? url : NULL,
                              NULL};
    pid_t child = fork();
    if (child == 0) {
        setpgid(0, 0);
        sigprocmask(SIG_SETMASK, signals, NULL);
        if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr))
            _exit(127);
        alarm(120);
        execvp(browser, (char *const *)argument);
        _exit(127);
    }
    if (child > 0)
        setpgid(child, child);
    return child > 0 && has_succeeded(child);
}

static void remove_folder(const char *path)
{
    pid_t child = fork();
    if (child == 0) {
        execl("/bin/rm", "rm", "-r", "-f", "--", path, (char *)NULL);
        _exit(127);
    }
    if (child > 0)
        waitpid(child, NULL, 0);
}

// The bytes of the PDF; NULL if no browser printed it. The caller frees them.
static char *print_page(const char *folder, const char *path, const char *page, size_t length, const sigset_t *signals, size_t *pdf_length, Faults *faults)
{
    static const char *const browsers[] = {"chromium", "chromium-browser", "google-chrome"};
    char html[64], pdf[64];
    snprintf(html, sizeof html, "%s/page.html", folder);
    snprintf(pdf, sizeof pdf, "%s/page.pdf", folder);
    bool written = output_write(html, page, length, faults), printed = false;
    for (int i = 0; written && i < 3 && !printed && !is_stopped(); i++)
        printed = browser_prints(browsers[i], html, pdf, signals) && access(pdf, R_OK) == 0;
    Faults own;
    faults_clear(&own);
    char *bytes = printed ? whole_file_read(pdf, pdf_length, &own) : NULL;
    if (bytes && *pdf_length > 4 && !memcmp(bytes, "%PDF", 4))
        return bytes;
    free(bytes);
    if (written)
        faults_add(faults, path, 0, 0, "no PDF: chromium is not installed or could not print; --html F.html needs no browser");
    return NULL;
}

bool page_write_pdf(const char *path, const char *page, size_t length, Faults *faults)
{
    char folder[] = "/tmp/seldinger-page-XXXXXX";
    sigset_t stops, before;
    size_t pdf_length = 0;
    // the folder contains a trainee's page, so a stop is deferred until it is removed
    sigemptyset(&stops);
    sigaddset(&stops, SIGINT);
    sigaddset(&stops, SIGTERM);
    sigaddset(&stops, SIGHUP);
    sigprocmask(SIG_BLOCK, &stops, &before);
    bool is_made = mkdtemp(folder) != NULL;
    char *pdf = is_made ? print_page(folder, path, page, length, &before, &pdf_length, faults) : NULL;
    if (is_made)
        remove_folder(folder);
    else
        faults_add(faults, path, 0, 0, "cannot make a folder for the browser in /tmp");
    sigprocmask(SIG_SETMASK, &before, NULL);
    bool good = pdf && output_write(path, pdf, pdf_length, faults);
    free(pdf);
    return good;
}
