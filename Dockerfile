# polychirp in a container, without root:
#
#   docker build -t polychirp .
#   docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" polychirp run study.toml
#
# Kernels are compiled while the image is built, for the processor of that machine
# (docs/how-to/warm-up.md).
FROM python:3.13-slim AS build
WORKDIR /build
RUN python -m venv /venv
COPY build.in requirements.lock ./
# versions of the lock, without the packages that only tests need
RUN sed '/--hash/d; s/ *\\$//' requirements.lock > versions.txt && \
    /venv/bin/pip install --no-cache-dir -c versions.txt -r build.in
COPY LICENSE README.md pyproject.toml ./
COPY src src
RUN /venv/bin/pip install --no-cache-dir -c versions.txt --no-build-isolation '.[exchange]'

FROM python:3.13-slim
COPY --from=build /venv /venv
RUN useradd --create-home --uid 1000 polychirp && \
    mkdir /kernels /work && chown polychirp /kernels /work
# whoever runs the container can write to these two folders
ENV PATH=/venv/bin:$PATH MPLCONFIGDIR=/tmp/matplotlib NUMBA_CACHE_DIR=/kernels
USER polychirp
RUN polychirp warm-up && chmod -R a+rwX /kernels
WORKDIR /work
ENTRYPOINT ["polychirp"]
CMD ["--help"]
