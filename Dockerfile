# simscen and what it needs, for CI systems and for machines with another Python: docker build --tag simscen .
ARG PYTHON=3.11

FROM python:${PYTHON}-slim AS wheel
WORKDIR /src
COPY pyproject.toml README.md LICENSE ./
COPY simscen simscen
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:${PYTHON}-slim
RUN --mount=type=bind,from=wheel,source=/wheels,target=/wheels \
    pip install --no-cache-dir /wheels/*.whl && simscen --version
RUN useradd --create-home --uid 1000 simscen
USER 1000
WORKDIR /work
ENTRYPOINT ["simscen"]
CMD ["--help"]
